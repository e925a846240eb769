// Whether each ray meets anything in a scene on the device, for the rays that `occluded` leaves.
//#include occluded_answer
//#include ray_batch_left

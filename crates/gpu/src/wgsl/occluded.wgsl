// Whether each ray meets anything in a scene on the device. Rays that meet what single precision does not settle are left to
// `occluded_settled`.
//#include occluded_answer
//#include ray_batch_first

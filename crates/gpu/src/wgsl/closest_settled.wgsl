// The closest hit of each ray with a scene on the device, for the rays that `closest` leaves.
//#include closest_answer
//#include ray_batch_left

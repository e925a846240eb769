// The closest hit of each ray with a scene on the device. Rays that meet what single precision does not settle are left to
// `closest_settled`.
//#include closest_answer
//#include ray_batch_first

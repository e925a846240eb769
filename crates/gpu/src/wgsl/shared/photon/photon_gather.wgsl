// Gathering photons around a point over the voxels that a sphere touches, 27 at most: D. Bogolepov, D. Sopin, V. Turlapov 2010,
// "Simulation of caustics in real time", section 2.5; weights as in `vastlight-transport`, `photon::kernel`. Who includes this has the
// bindings `photon_map` and `voxels`, defines `of_near`, what a photon adds to the sum, and sets `gather_part`.
//#include photon_direction
//#include photon_grid

const WEIGHT_SMOOTHSTEP: u32 = 1u;

/// The photons that count, in their order: from the first on, up to before the second. Drivers let loops turn only so often.
var<private> gather_part: vec2<u32>;

/// A photon within the radius of a point.
struct Near {
    /// What it counts, 1/m^2.
    weight: f32,
    /// Power that arrived, W.
    flux: vec3<f32>,
    /// Unit vector to where it came from.
    wi: vec3<f32>,
    /// Of the surface, on the side that the light came from.
    normal: vec3<f32>,
    /// Of its way from the light, at most 255.
    segments: u32,
}

/// The share of the weight in the middle at a distance of at most 1, the radius.
fn weight_share(t: f32) -> f32 {
    let fallen = select(t, t * t * (3.0 - (t + t)), photon_map[GRID_WEIGHT] == WEIGHT_SMOOTHSTEP);
    return max(1.0 - fallen, 0.0);
}

fn photon_vec3(at: u32) -> vec3<f32> {
    return vec3<f32>(grid_f32(at), grid_f32(at + 1u), grid_f32(at + 2u));
}

fn near_at(at: u32, weight: f32) -> Near {
    let packed = vec2<u32>(photon_map[at + PHOTON_FROM], photon_map[at + PHOTON_NORMAL]);
    let above = packed >> vec2<u32>(2u * DIRECTION_BITS);
    var near: Near;
    near.weight = weight;
    near.flux = photon_vec3(at + PHOTON_FLUX);
    near.wi = direction_unpack(packed.x);
    near.normal = direction_unpack(packed.y);
    near.segments = above.x | (above.y << 4u);
    return near;
}

/// What a photon adds to the sum around a point.
fn gather_photon(at: vec3<f32>, photon: u32) -> vec3<f32> {
    let radius = grid_f32(GRID_RADIUS);
    let place = GRID_WORDS + photon * PHOTON_WORDS;
    let apart = photon_vec3(place) - at;
    let squared = dot(apart, apart);
    if (squared > radius * radius) {
        return vec3<f32>(0.0);
    }
    let share = weight_share(sqrt(squared) * grid_f32(GRID_ONE_OVER_RADIUS));
    return of_near(near_at(place, share * grid_f32(GRID_PEAK)));
}

/// The sum over all photons around a point.
fn gather(at: vec3<f32>) -> vec3<f32> {
    let radius = grid_f32(GRID_RADIUS);
    var sum = vec3<f32>(0.0);
    var first: vec3<u32>;
    var last: vec3<u32>;
    for (var axis = 0u; axis < 3u; axis++) {
        let low = at[axis] - radius;
        let high = at[axis] + radius;
        if (!(radius > 0.0 && high >= grid_f32(GRID_MIN + axis) && low <= grid_f32(GRID_MAX + axis))) {
            return sum;
        }
        first[axis] = grid_cell(axis, low);
        last[axis] = grid_cell(axis, high);
    }
    // One loop over the photons of all voxels: invocations side by side, which meet full voxels at different turns, turn no more often
    // than the one with the most photons.
    let sides = last - first + 1u;
    var ahead = sides.x * sides.y * sides.z;
    var run = vec2<u32>(0u);
    while (run.x < run.y || ahead > 0u) {
        if (run.x < run.y) {
            sum += gather_photon(at, run.x);
            run.x++;
        } else {
            ahead--;
            let cell = first + vec3<u32>(ahead / (sides.y * sides.z), (ahead / sides.z) % sides.y, ahead % sides.z);
            let own = voxels[grid_number(cell)];
            run = vec2<u32>(max(own.x, gather_part.x), min(own.y, gather_part.y));
        }
    }
    return sum;
}

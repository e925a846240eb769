// The triangle that a walk through pages judges, as a meeting.
//#include surface
//#include walk

fn tested_meeting(hit: Hit) -> Meeting {
    let cluster = read_cluster(tested.node);
    var corners: array<vec3<f32>, 3>;
    for (var corner = 0u; corner < 3u; corner++) {
        corners[corner] = page_corner(cluster, tested, corner);
    }
    let place = TrianglePlace(tested.page, page_place(tested));
    return Meeting(hit.t, vec2<f32>(hit.u, hit.v), hit.instance, hit.prim, place, corners);
}

// Hull stage of the tessellation path: a work-group a patch, an invocation a control point. The stencil is applied to the ring as seen
// from the patch's first ring vertex, one product after the other.
layout(local_size_x = 32) in;
layout(std430, binding = 7) writeonly buffer Support { vec4 support[]; };
uniform uint patch_count;

void main() {
    uint index = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (index >= patch_count) return;
    Patch p = patches[index];
    uint ring_size = heads[p.head + HEAD_RING], points = heads[p.head + HEAD_POINTS];
    uint weights = heads[p.head + HEAD_REALS];
    bool shared_modes = (heads[p.head + HEAD_FLAGS] & PLAN_MODES) != 0u;
    vec3 origin = vertex_at(rings[p.ring]);
    for (uint i = gl_LocalInvocationID.x; i < p.rows; i += 32u) {
        vec3 sum = vec3(0.0);
        for (uint j = 1u; j < ring_size; ++j)
            sum += reals[weights + j * points + i] * (vertex_at(rings[p.ring + j]) - origin);
        support[p.support + i] = vec4(sum, shared_modes ? reals[weights + ring_size * points + i] : 0.0);
    }
}

// Regular patches: the sixteen base vertices are the control points, and there is no tree.
void main() {
    Part part = parts[part_index];
    Patch p = patches[part.patch_index];
    vec2 uv = part.corner + part.side * gl_TessCoord.xy;
    vec4 bu, du, bv, dv;
    spline(uv.x, bu, du);
    spline(uv.y, bv, dv);
    vec3 origin = vertex_at(rings[p.ring]), at = vec3(0.0), along_u = vec3(0.0), along_v = vec3(0.0);
    for (uint row = 0u; row < 4u; ++row) {
        vec3 sum = vec3(0.0), slope = vec3(0.0);
        for (uint i = 0u; i < 4u; ++i) {
            vec3 q = vertex_at(rings[p.ring + 4u * row + i]) - origin;
            sum += bu[i] * q;
            slope += du[i] * q;
        }
        at += bv[row] * sum;
        along_u += bv[row] * slope;
        along_v += dv[row] * sum;
    }
    put(origin + at, along_u, along_v, vec3(0.0));
}

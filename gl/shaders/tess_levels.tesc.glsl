// The part's own factors, untouched.
layout(vertices = 1) out;
flat in int part_of_control[];
patch out int part_index;

void main() {
    Part part = parts[part_of_control[0]];
    part_index = part_of_control[0];
    gl_TessLevelOuter[0] = part.outer.x;
    gl_TessLevelOuter[1] = part.outer.y;
    gl_TessLevelOuter[2] = part.outer.z;
    gl_TessLevelOuter[3] = part.outer.w;
    gl_TessLevelInner[0] = part.inner.x;
    gl_TessLevelInner[1] = part.inner.y;
}

// A corner of a triangle of the vertex stream. Corners are not shared: gl_VertexID tells which of the three.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 patch_uv;
layout(location = 3) in vec3 colour;
uniform mat4 view_projection;
out vec3 at;
out vec3 surface_normal;
out vec2 uv;
out vec3 base_colour;
out vec3 barycentric;

void main() {
    int corner = gl_VertexID % 3;
    at = position;
    surface_normal = normal;
    uv = patch_uv;
    base_colour = colour * colour;  // stored as square roots, for which 8 bits are enough
    barycentric = vec3(corner == 0, corner == 1, corner == 2);
    gl_Position = view_projection * vec4(position, 1.0);
}

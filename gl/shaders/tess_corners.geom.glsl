// A triangle's corners as geometry.frag.glsl wants them, with the coordinates that its wires are drawn by.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
in vec3 part_at[], part_normal[], part_colour[];
in vec2 part_uv[];
out vec3 at, surface_normal, base_colour, barycentric;
out vec2 uv;

void main() {
    for (int k = 0; k < 3; ++k) {
        at = part_at[k];
        surface_normal = part_normal[k];
        uv = part_uv[k];
        base_colour = part_colour[k];
        barycentric = vec3(k == 0, k == 1, k == 2);
        gl_Position = gl_in[k].gl_Position;
        EmitVertex();
    }
    EndPrimitive();
}

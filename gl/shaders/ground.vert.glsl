// A square of the ground plane, as a strip of four corners.
uniform mat4 view_projection;
uniform vec3 ground_centre;
uniform vec3 ground_u;
uniform vec3 ground_v;
out vec3 at;

void main() {
    float a = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
    float b = (gl_VertexID & 2) == 0 ? -1.0 : 1.0;
    at = ground_centre + a * ground_u + b * ground_v;
    gl_Position = view_projection * vec4(at, 1.0);
}

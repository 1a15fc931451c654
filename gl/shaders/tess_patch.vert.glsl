// One vertex a part: its number in this draw.
flat out int part_of_control;

void main() {
    part_of_control = gl_VertexID;
    gl_Position = vec4(0.0);
}

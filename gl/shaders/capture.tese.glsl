// LAYOUT: domain, spacing, orientation and point mode, set by the host.
layout(LAYOUT) in;
out vec2 uv;

void main() {
    uv = gl_TessCoord.xy;
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}

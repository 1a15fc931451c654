uniform vec3 background_top;
uniform vec3 background_bottom;
uniform float background_alpha;
uniform float height;
out vec4 result;

void main() {
    float t = smoothstep(0.0, 1.0, gl_FragCoord.y / height);
    result = vec4(mix(background_bottom, background_top, t), 1.0) * background_alpha;
}

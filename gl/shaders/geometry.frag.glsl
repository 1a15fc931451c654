// What is seen at a sample, for shade.frag.glsl. Shading waits until all is drawn, as the surface's triangles
// are often smaller than a pixel.
uniform vec3 eye;
in vec3 at;
layout(location = 0) out vec4 place;     // position; kind: 0 nothing, 1 ground, 2 surface, 3 its back
layout(location = 1) out vec4 facing;    // normal towards the eye; weight of the line between patches
layout(location = 2) out vec4 material;  // colour of the surface; weight of the wireframe

#ifdef GROUND
uniform vec3 up;
uniform vec3 ground_colour;

void main() {
    place = vec4(at, 1.0);
    facing = vec4(up, 0.0);
    material = vec4(ground_colour, 0.0);
}
#else
uniform float wire_width;
uniform float border_width;
in vec3 surface_normal;
in vec2 uv;
in vec3 base_colour;
in vec3 barycentric;

// Coverage of a line `width` pixels wide around value 0 of d.
float line(float d, float width) {
    return 1.0 - smoothstep(0.5 * width - 0.5, 0.5 * width + 0.5, d / max(fwidth(d), 1e-12));
}

void main() {
    vec3 v = normalize(eye - at);
    vec3 flat_normal = normalize(cross(dFdx(at), dFdy(at)));
    bool defined = dot(surface_normal, surface_normal) > 0.01;
    vec3 n = defined ? normalize(surface_normal) : flat_normal;
    if (defined && !gl_FrontFacing) n = -n;
    if (dot(n, v) < 0.0) n = normalize(n - 1.02 * dot(n, v) * v);  // a smooth normal at the silhouette
    float border = 0.0, wire = 0.0;
    if (border_width > 0.0)
        border = max(max(line(uv.x, border_width), line(1.0 - uv.x, border_width)),
                     max(line(uv.y, border_width), line(1.0 - uv.y, border_width)));
    if (wire_width > 0.0)
        wire = max(max(line(barycentric.x, wire_width), line(barycentric.y, wire_width)),
                   line(barycentric.z, wire_width));
    place = vec4(at, gl_FrontFacing ? 2.0 : 3.0);
    facing = vec4(n, border);
    material = vec4(base_colour, wire);
}
#endif

// What both evaluation shaders share: cubic B-splines and the outputs. LAYOUT: domain, spacing, orientation, and point mode for capture.
layout(LAYOUT) in;
patch in int part_index;
uniform mat4 view_projection;
uniform vec3 frame_centre, frame_rest;  // rest: what a float does not hold of the centre
uniform float frame_scale;
out vec3 part_at;
out vec3 part_normal;
out vec2 part_uv;
out vec3 part_colour;
flat out int part_number;
flat out float part_sine;  // of the angle between the tangents

// Weights and derivatives of the uniform cubic B-spline's four control points at t of a segment.
void spline(float t, out vec4 b, out vec4 d) {
    float s = 1.0 - t;
    b = vec4(s * s * s, 4.0 + t * t * (3.0 * t - 6.0), 4.0 + s * s * (3.0 * s - 6.0), t * t * t) / 6.0;
    d = vec4(-s * s, t * (3.0 * t - 4.0), s * (4.0 - 3.0 * s), t * t) * 0.5;
}

// position is in the local frame; sends it on, with whatever the captures and the fragment shader want.
void put(vec3 position, vec3 du, vec3 dv, vec3 substitute) {
    vec3 n = cross(du, dv);
    float lengths = length(du) * length(dv), area = length(n);
    part_sine = lengths > 0.0 ? area / lengths : 0.0;
    part_at = frame_centre + (frame_rest + frame_scale * position);
    part_normal = part_sine > 1e-4 ? n / area : substitute;
    part_uv = parts[part_index].corner + parts[part_index].side * gl_TessCoord.xy;
    part_colour = parts[part_index].colour * parts[part_index].colour;
    part_number = int(parts[part_index].number);
    gl_Position = view_projection * vec4(part_at, 1.0);
}

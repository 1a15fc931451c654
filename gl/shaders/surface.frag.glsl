// Shading of the surface and, with GROUND defined, of the ground under it. All light comes from LIGHTS
// directions: samples of the discs of key, fill and rim light, then of the sky. Each has a shadow map, so
// their sum has soft shadows and the sky's occlusion. Linear light in and out.
uniform vec3 eye;
uniform vec3 light_direction[LIGHTS];
uniform vec3 light_radiance[LIGHTS];
uniform vec4 light_rows[3 * LIGHTS];
uniform int light_count;  // LIGHTS, but unknown to the compiler, which would unroll the loops
uniform int lamp_count;   // the first ones are lamps (they glint), the others are sky
uniform int has_shadows;
uniform sampler2DArrayShadow shadows;
uniform float shadow_offset;
uniform vec3 up;
uniform vec3 sky_zenith;
uniform vec3 sky_horizon;
uniform vec3 sky_ground;
uniform float exposure;
in vec3 at;
out vec4 result;

float visibility(int light, vec3 p) {
    if (has_shadows == 0) return 1.0;
    vec4 q = vec4(p, 1.0);
    vec3 s = vec3(dot(light_rows[3 * light], q), dot(light_rows[3 * light + 1], q),
                  dot(light_rows[3 * light + 2], q));
    if (any(greaterThan(abs(s), vec3(0.999)))) return 1.0;
    s = 0.5 * s + 0.5;
    return texture(shadows, vec4(s.xy, float(light), s.z));
}

#ifdef GROUND
uniform vec3 ground_colour;
uniform vec3 ground_centre;
uniform float ground_fade;  // distance at which it has become background
uniform vec3 background_top;
uniform vec3 background_bottom;
uniform float background_alpha;
uniform float height;

void main() {
    vec3 lit = vec3(0.0), open = vec3(0.0);
    for (int k = 0; k < light_count; k++) {
        vec3 e = light_radiance[k] * max(dot(up, light_direction[k]), 0.0);
        open += e;
        lit += e * visibility(k, at + shadow_offset * up);
    }
    // Close by: the ground's own colour; far away the background, still darkened by what shadow is left.
    float t = smoothstep(0.0, 1.0, gl_FragCoord.y / height);
    vec4 back = vec4(mix(background_bottom, background_top, t), 1.0) * background_alpha;
    float fade = smoothstep(0.25, 1.0, distance(at, ground_centre) / ground_fade);
    vec4 front = vec4(ground_colour * lit * exposure, 1.0);
    vec4 far = vec4(back.rgb * lit / max(open, vec3(1e-6)), back.a);
    result = mix(front, far, fade);
}
#else
uniform vec3 back_colour;
uniform int use_back_colour;
uniform int show_normals;
uniform float gloss;
uniform float specular;
uniform float wire_width;
uniform vec3 wire_colour;
uniform float border_width;  // of the lines between patches
in vec3 surface_normal;
in vec2 uv;
in vec3 base_colour;
in vec3 barycentric;

// GGX lobe times the geometry term, by Karis' approximation.
float glint(float nl, float nv, float nh, float roughness) {
    float a = roughness * roughness, a2 = a * a;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float k = 0.5 * a;
    return a2 / (3.14159265 * d * d) * 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
}

vec3 shade(vec3 n, vec3 v, vec3 albedo) {
    float roughness = mix(0.75, 0.12, gloss), nv = max(dot(n, v), 1e-3);
    float f0 = 0.08 * specular;
    vec3 diffuse = vec3(0.0), shine = vec3(0.0), seen = vec3(0.0), sky = vec3(1e-6);
    vec3 p = at + shadow_offset * n;
    for (int k = 0; k < light_count; k++) {
        vec3 l = light_direction[k];
        float nl = dot(n, l);
        if (k >= lamp_count) sky += light_radiance[k] * abs(nl);
        if (nl <= 0.0) continue;
        vec3 e = light_radiance[k] * nl * visibility(k, p);
        diffuse += e;
        if (k >= lamp_count) {
            seen += e;
            continue;
        }
        vec3 h = normalize(l + v);
        float fresnel = f0 + (1.0 - f0) * pow(1.0 - max(dot(h, v), 0.0), 5.0);
        shine += e * 3.14159265 * fresnel * glint(nl, nv, max(dot(n, h), 0.0), roughness);
    }
    // Light from below, and what a polished surface mirrors of the sky.
    diffuse += sky_ground * 0.5 * (1.0 - dot(n, up)) * 0.35;
    vec3 r = reflect(-v, n);
    float height = dot(r, up);
    vec3 mirrored = height > 0.0 ? mix(sky_horizon, sky_zenith, sqrt(height))
                                 : mix(sky_horizon * 0.8, sky_ground, min(-3.0 * height, 1.0));
    float fresnel = f0 + (max(1.0 - roughness, f0) - f0) * pow(1.0 - nv, 5.0);
    float open = clamp(dot(seen, vec3(1.0)) / dot(sky, vec3(1.0)) * 1.3, 0.0, 1.0);
    return albedo * diffuse + specular * shine + mirrored * fresnel * open * (0.4 + 0.6 * gloss);
}

// Coverage of a line `width` pixels wide around value 0 of d.
float line(float d, float width) {
    return 1.0 - smoothstep(0.5 * width - 0.5, 0.5 * width + 0.5, d / max(fwidth(d), 1e-12));
}

void main() {
    vec3 v = normalize(eye - at);
    vec3 flat_normal = normalize(cross(dFdx(at), dFdy(at)));
    vec3 n = dot(surface_normal, surface_normal) > 0.01 ? normalize(surface_normal) : flat_normal;
    if (show_normals != 0) {
        vec3 s = 0.5 * n + 0.5;  // as sRGB values, so that a PNG holds them as they are
        result = vec4(mix(s / 12.92, pow((s + 0.055) / 1.055, vec3(2.4)), greaterThan(s, vec3(0.04045))), 1.0);
    } else {
        vec3 albedo = gl_FrontFacing || use_back_colour == 0 ? base_colour : back_colour;
        if (!gl_FrontFacing) n = -n;
        if (dot(n, v) < 0.0) n = normalize(n - 1.02 * dot(n, v) * v);
        result = vec4(min(shade(n, v, albedo) * exposure, vec3(8.0)), 1.0);
    }
    if (wire_width > 0.0) {
        float edge = max(max(line(barycentric.x, wire_width), line(barycentric.y, wire_width)),
                         line(barycentric.z, wire_width));
        result.rgb = mix(result.rgb, wire_colour, 0.75 * edge);
    }
    if (border_width > 0.0) {
        float edge = max(max(line(uv.x, border_width), line(1.0 - uv.x, border_width)),
                         max(line(uv.y, border_width), line(1.0 - uv.y, border_width)));
        result.rgb = mix(result.rgb, vec3(0.01), 0.8 * edge);
    }
}
#endif

#pragma once

/// GLSL of the colour pictures. Colours are linear until the last line of a fragment shader.
namespace arex::sim {

inline constexpr const char* kShadowVertexShader = R"(#version 450 core
layout(location = 0) in vec3 p_W;
uniform mat4 sun_from_world;  // to 0..1 in each axis
uniform float cut_above;
out float gl_ClipDistance[1];
void main() {
  gl_ClipDistance[0] = cut_above - p_W.z;
  vec3 s = (sun_from_world * vec4(p_W, 1.0)).xyz;
  gl_Position = vec4(2.0 * s.xy - 1.0, s.z, 1.0);
}
)";

inline constexpr const char* kSkyVertexShader = R"(#version 450 core
uniform mat3 R_WC;
uniform vec2 half_extent;  // tangents of the half angles of view
out vec3 ray;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  ray = R_WC * vec3(corner * half_extent, 1.0);
  gl_Position = vec4(corner, 0.5, 1.0);
}
)";

inline constexpr const char* kSkyFragmentShader = R"(#version 450 core
uniform vec3 to_sun;
in vec3 ray;
out vec4 colour;
void main() {
  vec3 d = normalize(ray);
  vec3 sky = mix(vec3(0.62, 0.72, 0.80), vec3(0.16, 0.34, 0.66), pow(max(d.z, 0.0), 0.55));
  sky += vec3(0.5, 0.4, 0.25) * pow(max(dot(d, to_sun), 0.0), 12.0);
  colour = vec4(pow(min(sky, 1.0), vec3(1.0 / 2.2)), 1.0);
}
)";

inline constexpr const char* kSurfaceVertexShader = R"(#version 450 core
layout(location = 0) in vec3 p_W;
layout(location = 1) in vec3 normal_W;
layout(location = 2) in vec4 colour_and_class;
uniform mat4 clip_from_world;
uniform float cut_above;
out float gl_ClipDistance[1];
out vec3 p;
out vec3 normal;
flat out vec3 albedo;
flat out int surface_class;
void main() {
  gl_ClipDistance[0] = cut_above - p_W.z;
  p = p_W;
  normal = normal_W;
  albedo = colour_and_class.rgb * colour_and_class.rgb;
  surface_class = int(colour_and_class.a * 255.0 + 0.5);
  gl_Position = clip_from_world * vec4(p_W, 1.0);
}
)";

// Classes by their number in worlds::SurfaceClass: 0 ground, 1 trunk, 2 branch, 3 leaf, 4 shrub.
inline constexpr const char* kSurfaceFragmentShader = R"(#version 450 core
uniform mat4 sun_from_world;
uniform vec3 p_WC;
uniform vec3 to_sun;
uniform float visibility;
uniform float headlight;
layout(binding = 0) uniform sampler2DShadow shadow_map;
in vec3 p;
in vec3 normal;
flat in vec3 albedo;
flat in int surface_class;
out vec4 colour;

float hash(vec3 i) { return fract(sin(dot(i, vec3(127.1, 311.7, 74.7))) * 43758.5453); }
float noise(vec3 x) {
  vec3 i = floor(x), f = fract(x);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(mix(hash(i), hash(i + vec3(1, 0, 0)), f.x),
                 mix(hash(i + vec3(0, 1, 0)), hash(i + vec3(1, 1, 0)), f.x), f.y),
             mix(mix(hash(i + vec3(0, 0, 1)), hash(i + vec3(1, 0, 1)), f.x),
                 mix(hash(i + vec3(0, 1, 1)), hash(i + vec3(1, 1, 1)), f.x), f.y), f.z);
}

vec3 texture_of_class() {
  if (surface_class == 0) {  // litter and moss
    float patches = noise(vec3(p.xy * 0.45, 0.0)), grain = noise(vec3(p.xy * 9.0, 3.0));
    vec3 moss = vec3(0.07, 0.11, 0.03);
    return mix(albedo, moss, smoothstep(0.45, 0.75, patches)) * (0.65 + 0.7 * grain);
  }
  if (surface_class == 1 || surface_class == 2 || surface_class == 5) {  // bark
    return albedo * (0.6 + 0.8 * noise(p * vec3(28.0, 28.0, 5.0)));
  }
  if (surface_class >= 6 && surface_class <= 11) {  // concrete
    return albedo * (0.88 + 0.16 * noise(p * 1.7) + 0.08 * noise(p * 14.0));
  }
  return albedo;
}

float sunlight(vec3 n) {
  vec3 s = (sun_from_world * vec4(p + 0.04 * n, 1.0)).xyz;
  if (any(lessThan(s, vec3(0.0))) || any(greaterThan(s, vec3(1.0)))) return 1.0;
  float lit = 0.0, texel = 1.0 / 4096.0;
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      lit += texture(shadow_map, vec3(s.xy + texel * vec2(i, j), s.z + 0.0006));
    }
  }
  return lit / 9.0;
}

void main() {
  vec3 to_eye = p_WC - p;
  float distance = length(to_eye);
  to_eye /= distance;
  vec3 n = normalize(normal);
  bool leaf = surface_class == 3 || surface_class == 4;
  if (dot(n, to_eye) < 0.0) n = -n;
  vec3 base = texture_of_class();

  float towards_sun = dot(n, to_sun);
  float direct = max(towards_sun, 0.0);
  vec3 through = vec3(0.0);
  if (leaf) {  // thin: what the far side receives shines through, yellower
    through = vec3(1.3, 1.25, 0.5) * 0.55 * max(-towards_sun, 0.0);
    direct = 0.25 + 0.75 * direct;
  }
  vec3 sun = vec3(2.5, 2.3, 1.95) * sunlight(n);
  vec3 sky = mix(vec3(0.20, 0.18, 0.13), vec3(0.52, 0.60, 0.70), 0.5 + 0.5 * n.z);
  // Under a roof less of the sky is seen, and a lamp at the eye helps.
  vec3 ambient = mix(sky, vec3(0.36, 0.35, 0.33) * (0.75 + 0.25 * n.z), headlight);
  vec3 lamp = headlight * vec3(2.0, 1.85, 1.6) * max(dot(n, to_eye), 0.0) /
              (1.0 + 0.02 * distance * distance);
  vec3 light = base * (sun * (direct + through) + ambient + lamp);
  float haze = 1.0 - exp(-pow(distance / visibility, 2.0));
  vec3 far = mix(vec3(0.62, 0.72, 0.80), vec3(0.10, 0.11, 0.12), headlight);
  light = mix(light, far, haze);
  light = light / (1.0 + 0.35 * light);  // soft shoulder
  colour = vec4(pow(min(light, 1.0), vec3(1.0 / 2.2)), 1.0);
}
)";

}  // namespace arex::sim

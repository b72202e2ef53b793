// How light leaves a surface: the formula of shading.py and shadows.py for graphics cards.
//
// It is a part of fragment shaders, in GLSL 3.30 and in GLSL ES 3.00 (which wants "precision highp float;" and
// "precision highp sampler2DArray;" before it). realizer/render/surfaces.py gives the uniforms; colours are
// linear light. Directions: +x the character's left, +y up, +z forward; places are in metres.

uniform sampler2D albedoMap;   // sRGB and alpha, unconverted
uniform sampler2D slopeMap;    // slopes of the relief along u and v, and of the folds; 128 is level
uniform sampler2D surfaceMap;  // occlusion, roughness, thickness
uniform sampler2D foldMap;     // depth of the folds
uniform highp sampler2D shadowMap;   // depths as the key lamp sees them, 0 near the lamp to 1
uniform mediump sampler2DArray mirrorMap;  // the environment by roughness, octahedral

uniform vec4 surfaceWrap[5];   // surfaces.toml, a row for each kind: wrap, shaded
uniform vec3 surfaceSoft[5];
uniform vec4 surfaceShine[5];  // reflection, sharp, sharp_share, through
uniform int hairKind, eyeKind;
uniform vec3 thinColour;       // colour of light that has come through thin skin
uniform float directShare;     // how far occlusion darkens light of lamps
uniform vec3 iris;             // place of its middle in the maps, and its radius there
uniform vec3 cornea;           // metres behind it of thickness 0; how it bends light; slope of the iris at its rim
uniform vec3 glint;            // of the key lamp on eyes: place, radius, brightness
uniform float steepest;        // slope at byte 255 of slopeMap
uniform float foldShade;       // share of the light that folds hide at byte 255 of foldMap
uniform vec3 ambientLight[9];  // the environment as spherical harmonics
uniform vec3 keyDirection, keyColour, rimDirection, rimColour;
uniform float rimPower;
uniform mat4 shadowView;       // from metres to shadowMap, 0..1 each way, and depth
uniform vec3 shadowSteps;      // metres before the surface, more where it is aslant, and of growing dark
uniform float shadowSide;      // texels of the filter's grid; shadowMap has twice as many

const float PI = 3.14159265;

vec3 linearOf(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}

// The sRGB colour of light in the picture. Source: Narkowicz 2015.
vec3 pictureOf(vec3 light) {
  vec3 x = clamp(light, 0.0, 8.0);
  vec3 c = clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 1e-6), vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), c));
}

// A vector at length 1; one without length stays as it is.
vec3 unitOf(vec3 a) {
  return a * inversesqrt(max(dot(a, a), 1e-20));
}

// The level of the maps whose texels are as large as pixels.
float levelOf(vec2 uv, vec2 texels) {
  vec2 a = dFdx(uv) * texels, b = dFdy(uv) * texels;
  return max(0.5 * log2(max(abs(a.x * b.y - a.y * b.x), 1e-9)), 0.0);
}

// Unit vectors on the surface along which u and v grow, as columns; zero where the map has no extent.
void frameOf(vec3 place, vec2 uv, out vec3 along, out vec3 down) {
  vec3 e = dFdx(place), f = dFdy(place);
  vec2 a = dFdx(uv), b = dFdy(uv);
  float turn = a.x * b.y - a.y * b.x;
  float way = abs(turn) < 1e-15 ? 0.0 : sign(turn);
  along = unitOf((b.y * e - a.y * f) * 1e4) * way;
  down = unitOf((a.x * f - b.x * e) * 1e4) * way;
}

// The scale of the maps on the surface, 1/m.
float scaleOf(vec3 place, vec2 uv) {
  vec2 a = dFdx(uv), b = dFdy(uv);
  float area = length(cross(dFdx(place) * 1e4, dFdy(place) * 1e4)) * 1e-8;
  return sqrt(abs(a.x * b.y - a.y * b.x) / max(area, 1e-20));
}

// The light of the environment on a white surface with that normal.
vec3 ambientOf(vec3 n) {
  vec3 light = ambientLight[0] + ambientLight[1] * n.y + ambientLight[2] * n.z + ambientLight[3] * n.x;
  light += ambientLight[4] * (n.x * n.y) + ambientLight[5] * (n.y * n.z);
  light += ambientLight[6] * (3.0 * n.z * n.z - 1.0) + ambientLight[7] * (n.x * n.z);
  return max(light + ambientLight[8] * (n.x * n.x - n.y * n.y), 0.0);
}

// The light that a surface of that roughness mirrors from direction d.
vec3 mirroredOf(vec3 d, float rough) {
  vec2 p = vec2(d.x, -d.y) / (abs(d.x) + abs(d.y) + abs(d.z));
  if (d.z < 0.0) p = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
  float last = float(textureSize(mirrorMap, 0).z - 1), level = clamp(rough, 0.0, 1.0) * last;
  float first = min(floor(level), last - 1.0);
  vec2 at = p * 0.5 + 0.5;
  return mix(textureLod(mirrorMap, vec3(at, first), 0.0).rgb,
             textureLod(mirrorMap, vec3(at, first + 1.0), 0.0).rgb, level - first);
}

// The microfacet term D V of a roughness.
float glossOf(float rough, float nh, float nl, float nv) {
  float a = rough * rough, bend = nh * nh * (a * a - 1.0) + 1.0;
  float shade = nl * (nv * (1.0 - a) + a) + nv * (nl * (1.0 - a) + a);
  return a * a / (PI * bend * bend) * 0.5 / max(shade, 1e-4);
}

// The highlight of a hair whose scales tilt it by `tilt` towards its root.
float strandGlossOf(vec3 strand, vec3 normal, vec3 between, float tilt, float power) {
  float th = dot(unitOf(strand + tilt * normal), between);
  return pow(max(1.0 - th * th, 1e-6), power * 0.5);
}

// The share of light from around that reaches a cavity whose walls have albedo a.
vec3 openOf(vec3 a, float occlusion) {
  vec3 low = (2.0404 * a - 0.3324) * occlusion - 4.7951 * a + 0.6417;
  return max(vec3(occlusion), (low * occlusion + 2.7552 * a + 0.6903) * occlusion);
}

// The share of the environment's light that is mirrored.
float mirrorShareOf(float f0, float rough, float nv) {
  float x = 1.0 - rough;
  float term = min(x * x, exp(-6.4324 * nv)) * x - rough * 0.0275 + 0.0425;
  float scale = -1.04 * term - rough * 0.572 + 1.04;
  return max(f0 * scale + 1.04 * term + rough * 0.022 - 0.04, 0.0);
}

// How bright the key lamp is mirrored by an eye, as a soft disc, faint where it is rough.
float glintOf(vec3 n, vec3 view, float rough) {
  float off = length(n - unitOf(keyDirection + glint.x * view));
  return glint.z * clamp(2.0 - 5.5 * rough, 0.15, 1.0) * smoothstep(0.0, 1.0, (glint.y - off) / (glint.y * 0.5));
}

// The light that a surface sends to the eye.
//   n, even, strand: normals of the relief and of the smooth surface, the direction of strands.
//   values: occlusion, roughness, thickness 0..1, and the share of the key light that is not in shadow.
//   view: unit vector to the eye.
vec3 reflectedBy(int kind, vec3 albedo, vec3 n, vec3 even, vec3 strand, vec4 values, vec3 view) {
  float occlusion = values.x, rough = values.y, thickness = values.z;
  float seen = mix(values.w, 1.0, surfaceWrap[kind].w * occlusion * occlusion);
  vec4 shine = surfaceShine[kind];
  bool hair = kind == hairKind;
  float reach = 1.0 - directShare * (1.0 - occlusion);
  float nv = max(dot(n, view), 1e-3), nl = dot(n, keyDirection), lit = dot(even, keyDirection);
  float edge = pow(1.0 - min(nv, 1.0), rimPower) * reach;
  float rim = max(0.0, (dot(n, rimDirection) + 0.3) / 1.3) * edge;
  float thin = (1.0 - thickness) * shine.w * occlusion * occlusion;
  vec3 wrap = surfaceWrap[kind].rgb;
  vec3 facing = max((nl + (lit - nl) * surfaceSoft[kind] + wrap) / (1.0 + wrap), 0.0);
  // Cards are made of flat pieces; the strands that they show bend as evenly as the normals do.
  strand = unitOf(strand - dot(strand, even) * even);
  float aslant = dot(strand, keyDirection), across = hair ? max(1.0 - aslant * aslant, 0.0) : 0.0;
  facing += across * (sqrt(across) * max(0.0, 0.5 + lit) - facing);
  vec3 behind = max(0.0, 0.1 - lit) * thin * thinColour;
  vec3 light = albedo * (keyColour * (facing * seen * reach + behind) + rimColour * rim);
  light += albedo * ambientOf(n) * openOf(albedo, occlusion);
  vec3 between = unitOf(keyDirection + view);
  if (hair) {
    float strength = max(0.0, 0.35 + lit) * seen * reach * (1.0 - rough * 0.6);
    float white = strandGlossOf(strand, even, between, -0.08, 90.0) * 0.07;
    float tinted = strandGlossOf(strand, even, between, 0.10, 22.0);
    return light + strength * (white + tinted * albedo) * keyColour + shine.x * occlusion * ambientOf(n);
  }
  float nh = max(dot(n, between), 0.0), away = 1.0 - max(dot(view, between), 0.0);
  float f0 = shine.x, fresnel = f0 + (1.0 - f0) * away * away * away * away * away;
  nl = max(nl, 0.0);
  float lobes = mix(glossOf(rough, nh, nl, nv), glossOf(rough * shine.y, nh, nl, nv), shine.z);
  bool coat = kind == eyeKind;
  light += (coat ? glintOf(even, view, rough) : lobes * fresnel * nl * PI * seen * reach) * keyColour;
  if (coat) {
    n = even;
    nv = max(dot(n, view), 1e-3);
  }
  float mirrored = mirrorShareOf(f0, rough, nv) * occlusion * occlusion;
  return light + mirrored * mirroredOf(2.0 * dot(n, view) * n - view, rough);
}

// The weights of the texels before, at and after the place 0..1 within a texel.
vec3 sharesOf(float at) {
  float f = clamp(at, 0.0, 1.0) - 0.5;
  return vec3(0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f));
}

// The share of the key lamp that a place with that normal sees.
float reachOf(vec3 place, vec3 normal) {
  vec3 depthRow = vec3(shadowView[0].z, shadowView[1].z, shadowView[2].z);
  float metre = length(depthRow), facing = -dot(depthRow, normal) / metre;
  float aside = sqrt(max(1.0 - facing * facing, 0.0)) / max(facing, 0.2);
  vec3 at = (shadowView * vec4(place, 1.0)).xyz;
  float depth = at.z - (shadowSteps.x + shadowSteps.y * aside) * metre;
  float soft = 1.0 / (shadowSteps.z * metre);
  vec2 texel = at.xy * shadowSide;
  ivec2 whole = ivec2(clamp(texel, 1.0, shadowSide - 2.0));
  vec3 wx = sharesOf(texel.x - float(whole.x)), wy = sharesOf(texel.y - float(whole.y));
  float seen = 0.0;
  for (int j = 0; j < 6; j++) {
    for (int i = 0; i < 6; i++) {
      float near = texelFetch(shadowMap, 2 * (whole - 1) + ivec2(i, j), 0).r;
      seen += wx[i / 2] * wy[j / 2] * clamp((near - depth) * soft + 1.0, 0.0, 1.0);
    }
  }
  return seen * 0.25;
}

// The share 0..1 of a pixel that a triangle with holes covers; `coarser` levels of the maps.
float coverOf(vec2 uv, float coarser) {
  return textureLod(albedoMap, uv, levelOf(uv, vec2(textureSize(albedoMap, 0))) + coarser).a;
}

// How far a ray has gone aside at a depth below the cornea, in lengths of `view` along it.
float diveOf(float depth, vec3 n, vec3 view) {
  float c = dot(n, view), bent = cornea.y;
  return depth * bent * inversesqrt(1.0 - bent * bent * (1.0 - c * c));
}

// The picture's colour, sRGB, of a point of a surface.
//   place, normal, strand: in metres; the normal and the direction of hairs at any length.
//   uv: (0, 0) at the top left of the maps.
//   colour: linear, multiplied with the albedo map. occlusion, rough: likewise with the surface map.
//   fold: share of the folds that shows. front: whether it is the front of the triangle. eye: the camera's place.
vec3 surfaceColour(int kind, vec3 place, vec3 normal, vec3 strand, vec2 uv, vec3 colour, vec2 occlusionRough,
                   float fold, bool front, vec3 eye) {
  float level = levelOf(uv, vec2(textureSize(albedoMap, 0)));
  vec3 along, down;
  frameOf(place, uv, along, down);
  vec3 view = unitOf(eye - place), even = unitOf(normal);
  // Hairs have the normals of the head that they grow on, whichever way their card is seen.
  if (!front && dot(even, view) < 0.0 && kind != hairKind) even = -even;
  vec3 values = textureLod(surfaceMap, uv, level).rgb;
  vec2 slope = vec2(0.0);
  float scale = scaleOf(place, uv);
  if (kind == eyeKind && values.z < 254.0 / 255.0) {
    float depth = cornea.x * (1.0 - values.z);
    uv -= scale * diveOf(depth, even, view) * vec2(dot(view, along), dot(view, down));
    values = textureLod(surfaceMap, uv, level).rgb;
    slope = cornea.z / iris.z * min(depth / 0.0004, 1.0) * (uv - iris.xy);
  }
  vec3 albedo = linearOf(textureLod(albedoMap, uv, level).rgb) * colour;
  vec4 slopes = textureLod(slopeMap, uv, level) * 255.0 - 128.0;
  slope += (slopes.xy + slopes.zw * fold) * (steepest / 127.0);
  vec3 relief = unitOf(even - slope.x * along - slope.y * down);
  values.xy *= occlusionRough;
  values.x *= 1.0 - foldShade * fold * textureLod(foldMap, uv, level).r;
  values.y = max(values.y, 0.06);
  return pictureOf(reflectedBy(kind, albedo, relief, even, unitOf(strand), vec4(values, reachOf(place, even)), view));
}

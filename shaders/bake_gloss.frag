// One level of a roughness chain, six faces one above the other: target N wide, 6 N high. Each texel is the mean of the
// lobe's samples round its own direction, each read from the level whose texels have the solid angle that the sample
// stands for (Krivanek and Colbert, "Real-time shading with filtered importance sampling", 2008; GPU Gems 3, chapter 20);
// and the light of the brightest texels, which the samples would miss or meet too often, by the lobe itself.

#include "lib/environment.glsl"
#include "lib/ggx.glsl"

uniform samplerCube environment;
// Of each sample, along x: its direction, z along the lobe's axis, and its level in the middle of a face.
uniform sampler2D lobe;
// Two rows: directions, and light over the integral of lobe_shape.
uniform sampler2D bright;
uniform float alpha;
uniform int face_size;

out vec4 color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int face = at.y / face_size;
    vec2 st = (vec2(at.x, at.y - face * face_size) + 0.5) / float(face_size);
    vec3 n = normalize(cube_dir(face, st));
    vec3 x, y;
    axes_across(n, x, y);
    int count = textureSize(lobe, 0).x;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < count; i++) {
        vec4 to = texelFetch(lobe, ivec2(i, 0), 0);
        vec3 dir = to.x * x + to.y * y + to.z * n;
        // Texels in a face's corner are smaller, by the cube of a direction's largest part.
        sum += textureLod(environment, dir, to.w - 1.5 * log2(largest_part(dir))).rgb;
    }
    sum /= float(count);
    for (int i = 0; i < textureSize(bright, 0).x; i++) {
        vec3 dir = texelFetch(bright, ivec2(i, 0), 0).xyz;
        sum += texelFetch(bright, ivec2(i, 1), 0).rgb * lobe_shape(dot(n, dir), alpha);
    }
    color = vec4(sum, 1.0);
}

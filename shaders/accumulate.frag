// Adds one sample picture, weighted, to the frame.

uniform sampler2D sample_picture;
uniform float weight;

out vec4 color;

void main() {
    color = weight * texelFetch(sample_picture, ivec2(gl_FragCoord.xy), 0);
}

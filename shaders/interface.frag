// Text and panels: a texture times a tint, both as the screen has them.

uniform sampler2D picture;

in vec2 at;
in vec4 colour;

out vec4 color;

void main() {
    color = colour * texture(picture, at);
}

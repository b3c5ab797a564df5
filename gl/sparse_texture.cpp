// SPDX-License-Identifier: Apache-2.0
#include "gl/sparse_texture.h"

#include "cuda/error.h"
#include "gl/context.h"
#include "gl/draw.h"

#include <epoxy/gl.h>

namespace shadowdag {

namespace {

GLenum formatOf(GlSparseArray::Texel texel) {
    return texel == GlSparseArray::kFloat ? GL_R32F : GL_R32UI;
}

} // namespace

uint32_t GlSparseArray::pageTexels() {
    if (!epoxy_has_gl_extension("GL_ARB_sparse_texture"))
        return 0;
    GLint sizes = 0, x = 0, y = 0;
    glGetInternalformativ(GL_TEXTURE_2D_ARRAY, GL_R32F, GL_NUM_VIRTUAL_PAGE_SIZES_ARB, 1, &sizes);
    if (sizes < 1)
        return 0;
    glGetInternalformativ(GL_TEXTURE_2D_ARRAY, GL_R32F, GL_VIRTUAL_PAGE_SIZE_X_ARB, 1, &x);
    glGetInternalformativ(GL_TEXTURE_2D_ARRAY, GL_R32F, GL_VIRTUAL_PAGE_SIZE_Y_ARB, 1, &y);
    return x == y && x > 0 ? uint32_t(x) : 0;
}

GlSparseArray::GlSparseArray(uint32_t side, uint32_t layers, uint32_t pageTexels, Texel texel,
                             Memory memory)
    : side_(side), pageTexels_(pageTexels), texel_(texel), memory_(memory) {
    checkGl("work before a sparse texture");
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture_);
    if (memory == kSparse) {
        glTextureParameteri(texture_, GL_TEXTURE_SPARSE_ARB, GL_TRUE);
        glTextureParameteri(texture_, GL_VIRTUAL_PAGE_SIZE_INDEX_ARB, 0);
    }
    glTextureParameteri(texture_, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture_, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTextureStorage3D(texture_, 1, formatOf(texel), GLsizei(side), GLsizei(side), GLsizei(layers));
    try {
        checkGl("making a sparse texture");
    } catch (const Error& error) {
        glDeleteTextures(1, &texture_);
        throw Error(ErrorKind::kResource,
                    "no sparse texture of " + std::to_string(layers) + " layers of " +
                        std::to_string(side) + " x " + std::to_string(side) +
                        " texels: " + error.what() +
                        "; keep pages in an atlas, or lower the largest face resolution");
    }
}

GlSparseArray::~GlSparseArray() {
    glDeleteFramebuffers(1, &framebuffer_);
    glDeleteTextures(1, &texture_);
}

void GlSparseArray::commit(uint32_t layer, uint32_t x, uint32_t y, uint32_t count,
                           bool isCommitted) {
    if (memory_ == kDense)
        return;
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture_);
    glTexPageCommitmentARB(GL_TEXTURE_2D_ARRAY, 0, GLint(x * pageTexels_), GLint(y * pageTexels_),
                           GLint(layer), GLsizei(count * pageTexels_), GLsizei(pageTexels_), 1,
                           isCommitted ? GL_TRUE : GL_FALSE);
}

void GlSparseArray::copyPages(const GlSparseArray& from, uint32_t layer, uint32_t x, uint32_t y,
                              uint32_t count) {
    const GLint left = GLint(x * pageTexels_), below = GLint(y * pageTexels_);
    glCopyImageSubData(from.texture_, GL_TEXTURE_2D_ARRAY, 0, left, below, GLint(layer), texture_,
                       GL_TEXTURE_2D_ARRAY, 0, left, below, GLint(layer),
                       GLsizei(count * pageTexels_), GLsizei(pageTexels_), 1);
}

void GlSparseArray::bindTarget() {
    if (!framebuffer_) {
        glCreateFramebuffers(1, &framebuffer_);
        glNamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, texture_, 0);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    glViewport(0, 0, GLsizei(side_), GLsizei(side_));
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glDisable(GL_CULL_FACE);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_DITHER);
    glEnable(GL_BLEND);
    glBlendEquation(GL_MAX);
    glBlendFunc(GL_ONE, GL_ONE);
}

void GlSparseArray::bindTexture(uint32_t unit) const {
    glBindTextureUnit(unit, texture_);
}

void GlSparseArray::bindImage() const {
    glBindImageTexture(0, texture_, 0, GL_TRUE, 0, GL_READ_WRITE, formatOf(texel_));
}

namespace {

constexpr char kProbeVertex[] =
    "layout(location = 0) in uint item;\n"
    "void main() {\n"
    "    vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);\n"
    "    gl_Position = vec4(at, 0.5, 1.0);\n"
    "    gl_Layer = int(item);\n"
    "}\n";
constexpr char kProbeFragment[] =
    "layout(location = 0) out float color;\n"
    "void main() { color = float(int(gl_FragCoord.x) + int(gl_FragCoord.y) * 65536 + 1); }\n";
constexpr char kProbeRead[] =
    "layout(local_size_x = 64) in;\n"
    "uniform sampler2DArray picture;\nuniform uint side;\n"
    "layout(std430, binding = 0) buffer Wrong { uint wrong[]; };\n"
    "void main() {\n"
    "    uint i = gl_WorkGroupID.x * 64u + gl_LocalInvocationID.x;\n"
    "    ivec3 at = ivec3(i % side, i / side % side, i / (side * side));\n"
    "    if (texelFetch(picture, at, 0).r != float(at.x + at.y * 65536 + 1))\n"
    "        atomicAdd(wrong[0], 1u);\n"
    "}\n";

} // namespace

bool GlSparseArray::canBeDrawnInto(const std::string& layerExtension) {
    const uint32_t page = pageTexels();
    if (page == 0 || layerExtension.empty())
        return false;
    const uint32_t side = 2 * page, layers = 2;
    GlSparseArray array(side, layers, page, kFloat);
    for (uint32_t layer = 0; layer < layers; ++layer)
        for (uint32_t y = 0; y < 2; ++y)
            array.commit(layer, 0, y, 2, true);
    const GlProgram draw("sparse probe", {{GlStage::kVertex, "v"}, {GlStage::kFragment, "f"}},
                         {{"v", kProbeVertex}, {"f", kProbeFragment}},
                         {{"extension", layerExtension}});
    const GlProgram read("sparse probe", {{GlStage::kCompute, "c"}}, {{"c", kProbeRead}});
    GlCommands commands("sparse probe");
    commands.set({{3, 1, 0, 0}, {3, 1, 0, 1}});
    array.bindTarget();
    glDisable(GL_BLEND); // memory is not cleared
    commands.draw(draw, 0, commands.count());
    GlBuffer wrong("sparse probe");
    wrong.upload(std::vector<uint32_t>{0});
    wrong.bindStorage(0);
    array.bindTexture(0);
    read.setSampler("picture", 0);
    read.set("side", side);
    read.dispatch(uint64_t(side) * side * layers / 64);
    return wrong.download<uint32_t>()[0] == 0;
}

} // namespace shadowdag

// SPDX-License-Identifier: Apache-2.0
#include "gl/program.h"

#include "cuda/error.h"
#include "gl/context.h"

#include <epoxy/gl.h>

#include <cstdio>

namespace shadowdag {

namespace {

GLenum stageOf(GlStage stage) {
    return stage == GlStage::kVertex     ? GL_VERTEX_SHADER
           : stage == GlStage::kFragment ? GL_FRAGMENT_SHADER
                                         : GL_COMPUTE_SHADER;
}

std::string shaderLog(GLuint shader) {
    GLint length = 0;
    glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
    std::string log(size_t(length > 0 ? length : 0), '\0');
    if (length > 0)
        glGetShaderInfoLog(shader, length, nullptr, log.data());
    return log.c_str();
}

// The debug output about a refusal is in its log already.
void forgetGlErrors() {
    try {
        checkGl("a refusal");
    } catch (const Error&) {
    }
}

std::string programLog(GLuint program) {
    GLint length = 0;
    glGetProgramiv(program, GL_INFO_LOG_LENGTH, &length);
    std::string log(size_t(length > 0 ? length : 0), '\0');
    if (length > 0)
        glGetProgramInfoLog(program, length, nullptr, log.data());
    return log.c_str();
}

} // namespace

GlProgram::GlProgram(const std::string& name,
                     const std::vector<std::pair<GlStage, std::string>>& stages,
                     const GlslTexts& texts, const GlDefines& defines) {
    std::string head = "#version 450 core\n";
    for (const auto& [key, value] : defines)
        head += key == "extension" ? "#extension " + value + " : require\n"
                                   : "#define " + key + " " + value + "\n";
    object_ = glCreateProgram();
    for (const auto& [stage, path] : stages) {
        const GlslUnit unit = expandGlsl(texts, path);
        const std::string text = head + unit.text;
        const char* const source = text.c_str();
        const GLuint shader = glCreateShader(stageOf(stage));
        glShaderSource(shader, 1, &source, nullptr);
        glCompileShader(shader);
        GLint isDone = GL_FALSE;
        glGetShaderiv(shader, GL_COMPILE_STATUS, &isDone);
        const std::string log = isDone ? "" : nameGlslFiles(shaderLog(shader), unit.paths);
        glAttachShader(object_, shader);
        glDeleteShader(shader); // deleted with the program
        if (!isDone) {
            glDeleteProgram(object_);
            forgetGlErrors();
            throw Error(ErrorKind::kDevice, "OpenGL refused " + path + " of program '" + name +
                                                "':\n" + log +
                                                "use --backend cpu, and report this driver");
        }
    }
    glLinkProgram(object_);
    GLint isLinked = GL_FALSE;
    glGetProgramiv(object_, GL_LINK_STATUS, &isLinked);
    if (!isLinked) {
        const std::string log = programLog(object_);
        glDeleteProgram(object_);
        forgetGlErrors();
        throw Error(ErrorKind::kDevice, "OpenGL could not link program '" + name + "':\n" + log +
                                            "use --backend cpu, and report this driver");
    }
}

GlProgram::~GlProgram() {
    glDeleteProgram(object_);
}

int GlProgram::location(const char* uniform) const {
    return glGetUniformLocation(object_, uniform);
}

void GlProgram::set(const char* uniform, uint32_t value) const {
    glProgramUniform1ui(object_, location(uniform), value);
}

void GlProgram::set(const char* uniform, float value) const {
    glProgramUniform1f(object_, location(uniform), value);
}

void GlProgram::set(const char* uniform, double value) const {
    glProgramUniform1d(object_, location(uniform), value);
}

void GlProgram::set(const char* uniform, const glm::dvec3& value) const {
    glProgramUniform3d(object_, location(uniform), value.x, value.y, value.z);
}

void GlProgram::setSampler(const char* uniform, int unit) const {
    glProgramUniform1i(object_, location(uniform), unit);
}

void GlProgram::dispatch(uint64_t groupCount, uint64_t firstGroup) const {
    if (groupCount == 0)
        return;
    constexpr uint64_t kMost = 65535; // of an axis, by OpenGL's minimum
    const uint64_t rows = groupCount / kMost, rest = groupCount % kMost;
    glUseProgram(object_);
    if (rows > 0) {
        set("firstGroup", uint32_t(firstGroup));
        glDispatchCompute(GLuint(kMost), GLuint(rows), 1);
    }
    // A separate dispatch: a full last row would run groups of the next dispatch.
    if (rest > 0) {
        set("firstGroup", uint32_t(firstGroup + rows * kMost));
        glDispatchCompute(GLuint(rest), 1, 1);
    }
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
}

std::string glslConstant(uint32_t value) {
    return std::to_string(value) + "u";
}

std::string glslConstant(int32_t value) {
    return "(" + std::to_string(value) + ")";
}

std::string glslConstant(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "(%.16eLF)", value);
    return text;
}

GlslTexts operator+(GlslTexts a, const GlslTexts& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

} // namespace shadowdag

// SPDX-License-Identifier: Apache-2.0
// Programs from GLSL sources. The context that a program was created with must be current in every
// call.
#pragma once

#include "gl/glsl.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

enum class GlStage { kVertex, kFragment, kCompute };

/// Names and values of #define lines for a text.
using GlDefines = std::vector<std::pair<std::string, std::string>>;

/// Returns a constant of C++ in GLSL's spelling, exact to the bit: for those that no leaf text
/// (gl/leaf.h) can hold.
std::string glslConstant(uint32_t value);
std::string glslConstant(int32_t value);
std::string glslConstant(double value);

/// Owns a linked program.
class GlProgram {
public:
    /// Compiles and links. Throws Error kDevice with the compiler's log, its lines with their
    /// files. @param name for messages @param stages one file each @param texts all files that may
    /// be included
    GlProgram(const std::string& name, const std::vector<std::pair<GlStage, std::string>>& stages,
              const GlslTexts& texts, const GlDefines& defines = {});
    ~GlProgram();
    GlProgram(const GlProgram&) = delete;
    GlProgram& operator=(const GlProgram&) = delete;

    /// Set a uniform; one that the compiler removed as unused is ignored.
    void set(const char* uniform, uint32_t value) const;
    void set(const char* uniform, float value) const;
    void set(const char* uniform, double value) const;
    void set(const char* uniform, const glm::dvec3& value) const;
    /// Binds a sampler to a texture unit.
    void setSampler(const char* uniform, int unit) const;

    /// Runs exactly so many groups of a compute program, then makes their writes readable. More
    /// than fit along one axis continue along the next: a shader calls groupIndex()
    /// (gl/groups.glsl). Groups run in no order. @param firstGroup the index of the first, for
    /// those that read it; the last fits 32 bits
    void dispatch(uint64_t groupCount, uint64_t firstGroup = 0) const;

    uint32_t name() const { return object_; }

private:
    int location(const char* uniform) const;

    uint32_t object_ = 0;
};

/// The GLSL sources of this folder: gl/groups.glsl.
GlslTexts glGlsl();

/// Returns `a` followed by `b`.
GlslTexts operator+(GlslTexts a, const GlslTexts& b);

} // namespace shadowdag

// SPDX-License-Identifier: Apache-2.0
// A method: one way of answering the pairs of a frame, as users name it.
//
// Each method is one file in tools/settings/methods/ and one line in the registry (methods.cpp).
// What depends on the method asks it: what a frame by it needs, which cost model it means, which
// options of a frame it sets, and what of a sweep runs it.
#pragma once

#include "hybrid/frame.h"

#include <string>
#include <vector>

namespace shadowdag {

/// What a frame by a method needs besides the scene.
struct MethodNeeds {
    bool voxels = false;    ///< it traces rays through a DAG
    bool triangles = false; ///< it tests hits against triangles
    bool maps = false;      ///< it draws shadow maps
    bool routing = false;   ///< a cost model chooses the method of each map
};

/// One method. Immutable; compared by address.
class Method {
public:
    Method(std::string name, std::string help, MethodNeeds needs)
        : name_(std::move(name)), help_(std::move(help)), needs_(needs) {}
    virtual ~Method() = default;
    Method(const Method&) = delete;
    Method& operator=(const Method&) = delete;

    /// Returns the name that options and results have.
    const std::string& name() const { return name_; }
    /// Returns what --help says of it: a clause without a full stop.
    const std::string& help() const { return help_; }
    const MethodNeeds& needs() const { return needs_; }
    /// Returns whether rays stop at voxels, so that their offset and level of detail matter.
    bool stopsAtVoxels() const { return needs_.voxels && !needs_.triangles; }

    /// Returns whether it is the truth, which errors are measured against: it has pairs, but
    /// neither a cost model nor stages of a frame.
    virtual bool isTruth() const { return false; }
    /// Returns the cost model that it means, as makeCostModel takes it.
    /// @param asked what was asked of a method that routes; "" for its default
    virtual std::string modelText(const std::string& asked) const = 0;
    /// Sets what the method fixes of a frame's options.
    virtual void configure(FrameOptions&) const {}
    /// Returns whether a sweep over thresholds runs it at this one, in texels.
    virtual bool isRunAtThreshold(float) const { return false; }
    /// Returns whether a sweep runs it once a DAG and combination of what it reads, whatever the
    /// thresholds are.
    virtual bool isRunAlone() const { return false; }
    /// Returns by what less simple methods are told from simpler ones, the least the simplest, for
    /// `fit`; methods that `fit` does not take have -1.
    virtual int complexity() const { return -1; }

private:
    std::string name_, help_;
    MethodNeeds needs_;
};

/// Returns all methods, in the order in which they are charted.
const std::vector<const Method*>& methods();
/// Returns the method of a name, or null.
const Method* findMethod(const std::string& name);
/// Returns the method of a name that was checked before. Throws std::logic_error for another.
const Method& methodOf(const std::string& name);
/// Returns the names of all methods, in the order of methods().
const std::vector<std::string>& methodNames();
/// Returns names as people read a list: "embree, dag, maps".
std::string joinedNames(const std::vector<std::string>& names);

} // namespace shadowdag

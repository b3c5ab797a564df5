// SPDX-License-Identifier: Apache-2.0
// A method: one way of computing the pairs of a frame, with the name that users give.
//
// Each method is one file in tools/settings/methods/ and one line in the registry (methods.cpp).
// Code that depends on the method asks it: what a frame needs, its cost model, and which runs of a
// sweep use it.
#pragma once

#include "hybrid/frame.h"

#include <string>
#include <vector>

namespace shadowdag {

/// The needs of a frame by a method besides the scene.
struct MethodNeeds {
    bool rays = false;    ///< it traces our rays; RayOptions::believe says through what
    bool embree = false;  ///< it traces rays of Embree: no setting of rays is read
    bool maps = false;    ///< it draws shadow maps
    bool routing = false; ///< a cost model chooses the method of each map
};

/// One method. Immutable; compared by address.
class Method {
public:
    Method(std::string name, std::string help, MethodNeeds needs)
        : name_(std::move(name)), help_(std::move(help)), needs_(needs) {}
    virtual ~Method() = default;
    Method(const Method&) = delete;
    Method& operator=(const Method&) = delete;

    /// Returns its name in options and results.
    const std::string& name() const { return name_; }
    /// Returns its description in --help: a clause without a full stop.
    const std::string& help() const { return help_; }
    const MethodNeeds& needs() const { return needs_; }

    /// Returns whether it is the truth, which errors are measured against: it has pairs and a
    /// picture, but neither a cost model nor stages of a frame, and is not timed.
    virtual bool isTruth() const { return false; }
    /// Returns its cost model, as makeCostModel takes it.
    /// @param asked the requested model of a method that routes; "" for its default
    virtual std::string modelText(const std::string& asked) const = 0;
    /// Changes the options of rays to those that the method demands, whatever the settings.
    virtual void takeOver(RayOptions&) const {}
    /// Returns whether a sweep over thresholds runs it at this one, in texels.
    virtual bool isRunAtThreshold(float) const { return false; }
    /// Returns the order of simplicity, the least the simplest, for `fit`; methods that `fit` does
    /// not use have -1.
    virtual int complexity() const { return -1; }

private:
    std::string name_, help_;
    MethodNeeds needs_;
};

/// Returns all methods, in the order of the window's keys.
const std::vector<const Method*>& methods();
/// Returns the method of a name, or null.
const Method* findMethod(const std::string& name);
/// Returns the method of a name that was checked before. Throws std::logic_error for another.
const Method& methodOf(const std::string& name);
/// Returns the names of all methods, in the order of methods().
const std::vector<std::string>& methodNames();
/// Returns those that render frames, which are measured: all but the truth.
const std::vector<std::string>& measuredMethodNames();
/// Returns names as text: "embree, dag, maps".
std::string joinedNames(const std::vector<std::string>& names);

} // namespace shadowdag

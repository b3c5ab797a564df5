// SPDX-License-Identifier: Apache-2.0
// One setting of an experiment: a row of the table in settings_table.cpp.
//
// Everything that names a setting is derived from its row: the option and its help, the key of
// experiment files, the values that a sweep combines, labels and parameters of results, the refusal
// of settings that no method reads, and the controls of the window. A new setting is a field of
// Experiment (and FrameOptions), one row, and the code that reads the field.
#pragma once

#include "tools/settings/experiment.h"

#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

/// Which configurations read a setting.
enum class ReadBy : uint8_t {
    kAll,         ///< every one, or the run itself
    kRays,        ///< methods dag and hybrid
    kExactRays,   ///< methods dag and hybrid with --believe none
    kVoxels,      ///< what uses voxels
    kVoxelsAlone, ///< methods that trace every light through voxels
    kMaps,        ///< methods that draw maps
    kKept,        ///< methods that keep maps or beams from frame to frame
    kHybrid,      ///< method hybrid
};

/// Returns whether a configuration reads what is read by `readBy`.
bool reads(const RunParameters& run, ReadBy readBy);

/// The heading under which an option stands in --help.
enum class SettingGroup : uint8_t {
    kNone, ///< no option, or declared by its command
    kSweep,
    kRoutes,
    kView,
    kViews, ///< of commands that treat each view of a scene by itself
    kPictures,
    kLights,
    kVoxels,
    kRays,
    kMaps,
};

/// The type of a value in an experiment file.
enum class JsonForm : uint8_t { kNumber, kText, kFlag, kNumberOrText };

/// A row of the table. Texts are those of options; a list has one text per value.
struct Setting {
    std::string key{};    ///< in experiment files; "";
    std::string option{}; ///< "--page-size"; "": none
    SettingGroup group = SettingGroup::kNone;
    std::string kind{};         ///< placeholder of one value in --help
    std::string help{};         ///< without the default
    std::string shownDefault{}; ///< in --help instead of the default's text
    ReadBy readBy = ReadBy::kAll;
    JsonForm form = JsonForm::kNumber;
    bool isList = false;               ///< always a list in experiment files
    bool isVaried = false;             ///< a sweep combines its values: options take a list
    bool mayBeEmpty = false;           ///< the list
    bool isSetByVariant = false;       ///< an error beside variants, whose names set it
    bool isSettableByVariants = false; ///< a variant's name may set it (T<n>, RH<m>)

    /// Sets the experiment's field. Throws Error kUsage beginning with `name`, which is the option
    /// or the quoted key.
    std::function<void(Experiment&, const std::string& name, const std::vector<std::string>&)>
        set{};
    /// Returns the field's values as texts.
    std::function<std::vector<std::string>(const Experiment&)> texts{};
    /// Returns the field in the form of experiment files.
    std::function<Json(const Experiment&)> json{};

    // Only of settings of a frame:
    std::string label{}; ///< of a run whose value is not the default; '#' is replaced by the value
    bool isAlwaysInLabel = false;       ///< of the default as well
    std::string parameter{};            ///< its key in the parameters of results
    std::vector<std::string> choices{}; ///< that the window's panel offers
    std::string panelLabel{};
    std::string onGl{}; ///< the default on the backend gl if it does not support the other one
    /// Sets a frame's option to value `index` of the experiment's.
    std::function<void(const Experiment&, size_t index, FrameOptions&)> apply{};
    /// Sets a frame's option to the value of a text. Throws as `set`.
    std::function<void(FrameOptions&, const std::string& name, const std::string& text)> setFrame{};
    std::function<std::string(const FrameOptions&)> frameText{};
    std::function<Json(const FrameOptions&)> frameJson{};

    bool isOfFrame() const { return bool(apply); }
    /// Returns the default as --help has it: values joined by commas.
    std::string defaultText() const;
};

/// Returns the table, in the order in which experiment files are written.
const std::vector<Setting>& settings();
/// Returns the setting of an option. Throws std::logic_error if there is none.
const Setting& settingOf(const std::string& option);

/// Returns the settings of an experiment that frames use, in the order in which a sweep varies
/// them, the first slowest.
const std::vector<const Setting*>& frameSettings();

} // namespace shadowdag

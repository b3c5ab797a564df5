// SPDX-License-Identifier: Apache-2.0
// The window's state and its parts. Used by the window's own thread only; internal to view_*.
#pragma once

#include "tools/window/view_camera.h"
#include "tools/window/view_demo.h"
#include "tools/window/view_request.h"

#include <array>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct ImVec2;

namespace shadowdag {

/// Times and errors of both sides, picture by picture, for the graphs.
struct ViewSample {
    std::array<std::vector<float>, 2> groupsMs; ///< by side and group (kStageGroups); or empty
    std::array<float, 2> falseShadow{-1, -1}, falseLight{-1, -1}; ///< shares; -1: not known
    float scale = 1;
};

constexpr size_t kHistoryLength = 180;

/// Returns a colour as Dear ImGui packs it.
uint32_t packedColor(const glm::vec3& display, float alpha = 1.0f);

/// Groups of stages for the graphs; the stages of a group are added.
struct StageGroup {
    const char* name;
    glm::vec3 color; ///< Okabe and Ito's
};
constexpr size_t kStageGroupCount = 8;
extern const std::array<StageGroup, kStageGroupCount> kStageGroups;
/// Returns the group of a stage.
size_t stageGroup(const std::string& stage);

/// How a cost model is chosen in the panel.
enum class ModelKind { kTexels, kCost, kOracle, kExpression, kOther };

struct ViewUi {
    ViewRequest request;
    FlyCamera camera;
    bool isFlying = false; ///< the camera is `camera`, else request.camera names one
    double speed = 1;      ///< metres a second
    ViewSceneInfo scene;
    bool hasScene = false;
    std::shared_ptr<const ViewPicture> picture;
    std::deque<ViewSample> history;

    bool isPlaying = false;
    double playedFrame = 0;
    float threshold = 96; ///< of both sides' texels models
    ModelKind modelKind = ModelKind::kTexels;
    std::string expression = "texels < 96";
    std::string otherModel; ///< that --model named, as it was written; "": one of the kinds above
    int resolutionLog2 = 10;
    bool showsPanel = true, showsLights = false, showsGraphs = true;
    bool wantsSave = false;
    bool wantsFreeze = false; ///< freeze, or leave it
    bool wantsVoxels = false; ///< resolutionLog2 was changed
    std::string path;         ///< as entered: a scene, voxels or costs
    bool wantsPath = false;   ///< path is to be opened
    std::string costs;        ///< the file of costs for routing; "": none
    std::string backend = "cpu";
    bool wantsBackend = false;                ///< backend was changed
    std::string message;                      ///< files written
    std::string openError;                    ///< why what was named or dropped is not opened
    std::vector<std::string> notes;           ///< remarks of opening the scene
    std::shared_ptr<const PixelReport> pixel; ///< the last report of request.pixel
    int pixelLight = -1;                      ///< whose pair with it is drawn; -1: any
    std::string statusWork, statusError;
    double statusFraction = 0;
    double interfaceFps = 0;
    double latencyMs = 0;           ///< of the last moving picture
    float fontScale = 1;            ///< 1: text of 13 pixels
    std::optional<DemoMoment> demo; ///< while it runs
    bool hasChanged = false;        ///< the request changed since it was last sent
    bool isDragged = false;         ///< by a key or button that is still held

    /// Positions of widgets by name: x, y, width, height. For --log.
    std::map<std::string, std::array<int, 4>> layout;
    std::string tooltip; ///< that is shown
    std::string hovered; ///< the control under the mouse, and since when
    double hoveredSeconds = 0;
    /// Stores the position of the last widget.
    void mark(const std::string& name);
};

/// Sets the panel's controls to a cost model. @param model as makeCostModel takes it
void setModel(ViewUi& ui, const std::string& model);
/// Returns the cost model of the panel's controls, as makeCostModel takes it.
std::string modelText(const ViewUi& ui);

/// Draws the panel of that many pixels at the window's left and handles its input.
void drawPanel(ViewUi& ui, float width, float height, unsigned mapTexture);
/// Draws over the picture, which fills the rectangle: split, names, lights, legends, the pixel's
/// pairs, the demo's caption, messages.
void drawOverPicture(ViewUi& ui, const ImVec2& from, const ImVec2& to);
/// Adds a picture's numbers to the history.
void noteHistory(ViewUi& ui, const ViewPicture& picture);
/// Draws the graphs of stage times and of errors, each of that size.
void drawGraphs(const ViewUi& ui, float width, float height);

} // namespace shadowdag

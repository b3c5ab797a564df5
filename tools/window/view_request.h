// SPDX-License-Identifier: Apache-2.0
// The requests of the window to its renderer, and the replies. Values only: they are passed between
// threads.
#pragma once

#include "hybrid/frame.h"
#include "tools/settings/method.h"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// What the picture shows instead of the lit scene.
enum class ViewOverlay : uint8_t {
    kNone,
    kClusters,    ///< every cluster in its own colour
    kMethods,     ///< share of pairs by rays
    kRequested,   ///< face resolution that a sample's cluster requests of a light
    kAllocated,   ///< face resolution that the light's map has
    kPages,       ///< pages of the selected light's map
    kProjections, ///< cells of its projection map, bright where culling keeps them
    kVoxels,      ///< the voxels at a level, from the camera
    kSteps,       ///< nodes that a pixel's shadow rays read, on average
    kErrors,      ///< false shadow and false light
    kFalseShadow, ///< false shadow alone
    kFalseLight,  ///< false light alone
};
/// Their names in the window, by value.
constexpr std::array<const char*, 12> kOverlayNames{
    "lit scene",        "clusters", "method by light", "requested texels",
    "allocated texels", "pages",    "projection maps", "voxels",
    "ray steps",        "errors",   "false shadow",    "false light"};

/// Returns whether an overlay needs the truth.
inline bool needsTruth(ViewOverlay overlay) {
    return overlay >= ViewOverlay::kErrors;
}

/// One side of the split picture.
struct ViewSide {
    std::string method = "hybrid";   ///< a name of methods() (method.h)
    std::string model = "texels:96"; ///< of hybrid, as makeCostModel takes it
    /// Returns whether the model chooses the method of each map.
    bool isRouted() const { return methodOf(method).needs().routing; }
    bool operator==(const ViewSide&) const = default;
};

/// A request for one picture.
struct ViewRequest {
    uint64_t serial = 0;         ///< ascending
    uint64_t scene = 0;          ///< ViewSceneInfo::serial; 0: whichever is open
    double requestedSeconds = 0; ///< of the caller's clock, handed back with the picture
    double changedSeconds = 0;   ///< the same, of the first change since the request before
    std::string camera;          ///< as --camera takes it
    std::string frozen; ///< the camera that clusters, maps and routes are of while `camera`
                        ///< observes; "": that is `camera` itself
    uint32_t frame = 0; ///< the scene at frame / fps seconds
    std::array<ViewSide, 2> sides;
    bool isSplit = false; ///< both sides, else the first
    float split = 0.5f;   ///< of the width that the first side has; for saved pictures
    ViewOverlay overlay = ViewOverlay::kNone;
    uint32_t voxelLevel = 0; ///< of kVoxels
    int light = -1;          ///< of kRequested, kAllocated: -1 for the most of any; of kPages,
                             ///< kProjections: -1 for the light with most samples
    FrameOptions options;    ///< width and height are the window's picture, before scaling
    bool isMoving = false;   ///< more requests follow at once: render at a reduced scale
    bool wantsMap = false;   ///< unfold the selected light's map, while the view rests
    bool wantsError = false; ///< compute the truth while the view rests
    float exposureStops = 0; ///< on top of the exposure found for the first picture of a scene
    std::optional<glm::vec2> pixel; ///< of the picture, [0, 1): its pairs are reported
    int caption = -1;       ///< index into kDemoCaptions (view_demo.h), handed back; -1: none
    bool wantsTour = false; ///< find the views that a demo flies to
};

/// The result of one method for one pair.
struct PairResult {
    std::string method;     ///< a name of methods() (method.h)
    int visibility = -1;    ///< 0 dark .. 255 lit; -1: not available
    double nanoseconds = 0; ///< of one evaluation, median of many
    std::string blocker;    ///< the blocker according to the method; "" if lit
};

/// Where the parts of a pair are in the world; what a method does not have is absent.
struct PairGeometry {
    glm::vec3 sampleWorld{0.0f}, lightWorld{0.0f};
    std::optional<Box> voxelWorld; ///< the cell that stops rays through voxels
    /// Corners, in order, of the nearest blocking texel of the light's map at its depth or, if none
    /// blocks, of the texel that holds the sample, at the sample's depth.
    std::optional<std::array<glm::vec3, 4>> texelWorld;
    std::optional<std::array<glm::vec3, 3>> triangleWorld; ///< the truth's blocker
};

/// One light of the selected pixel.
struct PixelPair {
    uint32_t light = 0;
    float distanceWorld = 0; ///< metres
    float cosine = 0;        ///< n . l
    std::string servedBy;    ///< "rays", "map", "proof"
    float requestedTexels = 0;
    uint32_t faceTexels = 0;
    std::vector<PairResult> answers;
    PairGeometry geometry;
};

/// The data of one pixel.
struct PixelReport {
    uint32_t x = 0, y = 0;  ///< of the picture as rendered
    bool hasSample = false; ///< else background
    glm::vec3 positionWorld{0.0f}, normalWorld{0.0f};
    std::string surface; ///< mesh, material
    uint32_t cluster = 0;
    std::vector<PixelPair> pairs;
};

/// Wrong pairs among those that the truth has computed so far.
struct ViewErrors {
    uint64_t pairCount = 0, falseShadowCount = 0, falseLightCount = 0;
    double doneShare = 0; ///< of the picture's samples
};

/// The picture of one side, with its times and errors.
struct SideReport {
    std::vector<uint8_t> rgba; ///< width * height * 4, display values; empty: not shown
    StageTimes stages;         ///< milliseconds; of the truth "truth"
    FrameCounts counts;
    std::vector<MapRecord> maps;
    std::optional<ViewErrors> errors;
};

/// The legend of a colour scale.
struct ViewLegend {
    std::string title;
    /// Position in [0, 1] from left to right, and its label.
    std::vector<std::pair<float, std::string>> ticks;
    /// Named colours instead of a scale.
    std::vector<std::pair<glm::vec3, std::string>> swatches;
};

/// One view of a demo's tour.
struct TourStop {
    Camera camera;
    bool isOpen = false; ///< nothing stands on the straight way from the stop before
};

/// The reply to a request.
struct ViewPicture {
    ViewRequest request;
    uint32_t width = 0, height = 0; ///< as rendered
    float scale = 1;                ///< of the picture's sides to the requested ones
    float mapScale = 1;             ///< of the texels of its maps to the requested ones
    bool isFinal = false;           ///< no further picture of this request follows
    double workMs = 0;              ///< from taking the request to this picture
    Camera camera;
    std::array<SideReport, 2> sides;
    std::vector<Light> lights;
    ViewLegend legend;
    std::optional<PixelReport> pixel;
    /// Six faces of the selected light's map, unfolded; empty: no map. RGBA.
    std::vector<uint8_t> mapRgba;
    uint32_t mapWidth = 0, mapHeight = 0;
    std::string mapTitle;
    std::vector<std::string> notes; ///< deviations from the request, such as a full pool
    std::string backend;            ///< backendName
    uint32_t devicePageTexels = 0;  ///< side of pages that the backend has; 0: any
    std::vector<TourStop> tour;     ///< of request.wantsTour
};

/// Information on the open scene.
struct ViewSceneInfo {
    uint64_t serial = 0; ///< ascending with every scene that is opened, not with its voxels
    std::string argument;
    uint64_t triangleCount = 0;
    uint32_t voxelResolution = 0; ///< 0: no voxels
    uint64_t voxelBytes = 0;
    uint32_t largestLog2 = 12;        ///< log2 of the voxels per axis that should fit into memory
    std::vector<Light> lights;        ///< at time 0
    std::vector<std::string> cameras; ///< those that --camera can name
    std::string cameraText;           ///< of the first view, as --camera takes it
    Camera camera;                    ///< the first view
    bool isPlaced = false;            ///< it was computed, not named: only numbers denote it
    bool isCameraAnimated = false;    ///< an animation moves the first view
    Box bounds;
    uint32_t frameCount = 1; ///< up to the end of the longest animation, at the clock's rate
    bool isAnimated() const { return frameCount > 1; }
};

} // namespace shadowdag

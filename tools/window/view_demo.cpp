// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_demo.h"

#include "scenes/camera_placement.h"
#include "tools/settings/parse.h"
#include "tools/window/view_camera.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

namespace shadowdag {

namespace {

/// The share of a caption's time in which the view moves; then it rests, so that the picture comes
/// at its full size.
constexpr double kFlightShare = 0.4;

/// Thresholds that the last caption steps through while the view rests, texels.
constexpr std::array<float, 6> kSweep{16, 64, 128, 256, 512, 1024};

/// By how much a view turns where it cannot fly, radians.
constexpr double kTurn = 0.2;

/// About as many cells an axis are shown by the caption about voxels: large enough to be seen.
constexpr uint32_t kShownCellsLog2 = 7;

/// Returns whether nothing stands within a fiftieth of its length beside a straight way.
bool isOpenWay(const Truth& truth, const glm::vec3& from, const glm::vec3& to) {
    const glm::vec3 way = to - from;
    const glm::vec3 aside = glm::abs(way.y) < glm::abs(way.x) + glm::abs(way.z)
                                ? glm::vec3(0, 1, 0)
                                : glm::vec3(1, 0, 0);
    const glm::vec3 a = 0.02f * glm::cross(way, aside), b = 0.02f * glm::length(way) * aside;
    for (const glm::vec3& shift : {glm::vec3(0.0f), a, -a, b, -b})
        if (truth.isBlocked(from + shift, to + shift))
            return false;
    return true;
}

double yawOf(const Camera& camera) {
    return std::atan2(double(-camera.forward.x), double(-camera.forward.z));
}

double pitchOf(const Camera& camera) {
    return std::asin(std::clamp(double(camera.forward.y), -1.0, 1.0));
}

/// Returns a camera that looks another way, its horizon level.
Camera turned(Camera camera, double yaw, double pitch) {
    const double steep = std::clamp(pitch, -1.5, 1.5); // straight up has no level right axis
    camera.forward = glm::vec3(-std::sin(yaw) * std::cos(steep), std::sin(steep),
                               -std::cos(yaw) * std::cos(steep));
    const glm::vec3 right(float(std::cos(yaw)), 0.0f, float(-std::sin(yaw)));
    camera.up = glm::cross(right, camera.forward);
    return camera;
}

} // namespace

const std::array<DemoCaption, kDemoCaptionCount> kDemoCaptions{
    {{"A pair: one point, one light",
      "Every visible point asks every light in reach whether its light arrives. Point and light "
      "are a pair. Where something stands between them the pair is dark: a shadow. The lines show "
      "one pair and what blocks it; millions of pairs make the picture.",
      ViewOverlay::kNone, "dag", nullptr, false, true, false},
     {"Rays through voxels",
      "One way to answer: trace a ray. The scene's voxels are stored as a graph in which equal "
      "parts are shared, so that billions of cells fit into megabytes. A ray visits only those "
      "that are not empty. Each colour is one cell, drawn coarser than it is traced.",
      ViewOverlay::kVoxels, "dag", nullptr, true, false, false},
     {"Shadow maps, page by page",
      "The other way: draw what the light sees. A light has a virtual cube map that is as fine as "
      "the picture needs, and only pages that some point looks up have memory. Each colour is one "
      "page of the light that reaches most points.",
      ViewOverlay::kPages, "maps", nullptr, false, false, false},
     {"Who serves which light",
      "The hybrid chooses for every map: rays where few points ask, the map where many share it. "
      "Pairs in sky blue are traced, pairs in orange are looked up. The discs are the lights.",
      ViewOverlay::kMethods, "hybrid", nullptr, false, false, false},
     {"The truth and the error",
      "Embree decides every pair once more: the truth, on the right. On the left are the pairs "
      "that maps got wrong: vermilion for false shadow, blue for false light. These are the errors "
      "that every chart counts.",
      ViewOverlay::kErrors, "maps", "truth", false, false, false},
     {"The threshold",
      "The hybrid in one number: maps that need fewer texels than the threshold are replaced by "
      "rays. It rises from 16 to 1024 texels: sky blue spreads, and the time above changes.",
      ViewOverlay::kMethods, "hybrid", nullptr, false, false, true}}};

void Demo::stepTo(double now, int shown) {
    const double step = before_ < 0 ? 0.0 : std::max(now - before_, 0.0);
    before_ = now;
    const DemoMoment current = moment();
    if (int(current.caption()) != shown)
        return;
    seconds_ = std::min(seconds_ + step, double(current.number + 1) * captionSeconds_);
}

DemoMoment Demo::moment() const {
    DemoMoment moment;
    const double captions = seconds_ / captionSeconds_;
    moment.number = size_t(captions);
    moment.share = captions - double(moment.number);
    const double flown = std::min(moment.share / kFlightShare, 1.0);
    moment.isFlying = flown < 1.0;
    moment.flown = flown * flown * (3.0 - 2.0 * flown);
    if (kDemoCaptions[moment.caption()].sweepsThreshold) {
        const double rested = std::max(moment.share - kFlightShare, 0.0) / (1.0 - kFlightShare);
        moment.threshold =
            kSweep[std::min(size_t(rested * double(kSweep.size())), kSweep.size() - 1)];
    }
    return moment;
}

std::vector<TourStop> findTour(const World& world, const Truth& truth) {
    std::vector<TourStop> tour;
    for (const Camera& camera : placeCameras(world, kDemoCaptionCount))
        tour.push_back({camera, false});
    for (size_t i = 0; tour.size() > 1 && i < tour.size(); ++i)
        tour[i].isOpen =
            isOpenWay(truth, tour[(i + tour.size() - 1) % tour.size()].camera.positionWorld,
                      tour[i].camera.positionWorld);
    return tour;
}

Camera tourCamera(const std::vector<TourStop>& tour, const DemoMoment& moment) {
    const TourStop& stop = tour[moment.number % tour.size()];
    const Camera& from = tour[(moment.number + tour.size() - 1) % tour.size()].camera;
    const double yaw = yawOf(stop.camera), pitch = pitchOf(stop.camera), left = 1.0 - moment.flown;
    if (tour.size() == 1) // there and back, without a jump
        return turned(stop.camera, yaw + kTurn * std::sin(2.0 * std::numbers::pi * moment.flown),
                      pitch);
    if (!stop.isOpen)
        return turned(stop.camera, yaw + kTurn * left, pitch);
    Camera camera =
        turned(stop.camera, yaw + left * std::remainder(yawOf(from) - yaw, 2.0 * std::numbers::pi),
               pitch + left * (pitchOf(from) - pitch));
    camera.positionWorld = glm::mix(stop.camera.positionWorld, from.positionWorld, float(left));
    camera.yfov = glm::mix(stop.camera.yfov, from.yfov, float(left));
    return camera;
}

bool showMoment(const DemoMoment& moment, const ViewSceneInfo& scene,
                const std::vector<TourStop>& tour, float believe, ViewRequest& request) {
    const ViewRequest before = request;
    const DemoCaption& caption = kDemoCaptions[moment.caption()];
    request.caption = int(moment.caption());
    request.overlay = caption.overlay;
    request.isSplit = caption.right != nullptr;
    const std::string model = "texels:" + numberText(double(moment.threshold));
    request.sides[0] = {caption.left, model};
    if (request.isSplit)
        request.sides[1] = {caption.right, model};
    request.options.rays.believe =
        caption.believesAll ? std::numeric_limits<float>::infinity() : believe;
    const uint32_t log2 = uint32_t(std::bit_width(std::max(scene.voxelResolution, 1u))) - 1;
    request.voxelLevel = log2 - std::min(log2, kShownCellsLog2);
    request.light = -1;
    request.frozen.clear();
    request.wantsError = true;
    request.pixel.reset();
    if (caption.picksPixel && !moment.isFlying)
        request.pixel = glm::vec2(0.5f, 0.55f);
    if (tour.empty()) {
        request.camera = scene.cameraText;
        const double done = (double(moment.caption()) + moment.flown) / double(kDemoCaptionCount);
        request.frame = uint32_t(std::lround(done * double(scene.frameCount - 1)));
    } else {
        request.camera = FlyCamera(tourCamera(tour, moment)).text();
    }
    return request.caption != before.caption || request.overlay != before.overlay ||
           request.isSplit != before.isSplit || request.sides != before.sides ||
           !(request.options == before.options) || request.voxelLevel != before.voxelLevel ||
           request.light != before.light || request.frozen != before.frozen ||
           request.wantsError != before.wantsError || request.pixel != before.pixel ||
           request.camera != before.camera || request.frame != before.frame;
}

} // namespace shadowdag

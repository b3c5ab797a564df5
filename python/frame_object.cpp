// SPDX-License-Identifier: Apache-2.0
#include "python/frame_object.h"

#include "python/arrays.h"
#include "python/callable_model.h"
#include "python/json_object.h"
#include "python/pair_report.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/provenance.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/timing.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <bit>

namespace shadowdag::python {

namespace {

using Object = std::shared_ptr<FrameObject>;

void requireLights(const SceneObject& scene) {
    if (scene.world().lights().empty())
        throw Error(ErrorKind::kInput, scene.scene().argument +
                                           ": has no supported light; place some with "
                                           "load(..., lights=32) or scene(..., placed_lights=32)");
}

/// Returns a text that is the same for frames with the same pairs, and another for all others.
std::string keyOf(const Camera& camera, float timeSeconds, const FrameOptions& options) {
    const glm::vec3 &at = camera.positionWorld, &to = camera.forward, &up = camera.up;
    std::string key;
    for (const float number : {at.x, at.y, at.z, to.x, to.y, to.z, up.x, up.y, up.z, camera.yfov,
                               camera.znear, camera.zfar, timeSeconds})
        key += std::to_string(std::bit_cast<uint32_t>(number)) + " ";
    return key + std::to_string(options.width) + "x" + std::to_string(options.height);
}

/// Returns the costs of a view's maps, measured at the first call. Within runAlone.
const FrameCosts& costsOf(SceneObject& scene, FrameRenderer& renderer, const FrameObject& frame,
                          const RunParameters& run) {
    const std::string key = frame.view + " " + run.toJson().dump();
    auto found = scene.costs.find(key);
    if (found == scene.costs.end())
        found = scene.costs.emplace(key, renderer.measureCosts(frame.camera, run.frame)).first;
    return found->second;
}

/// Returns the costs that the request replays. Throws Error kInput where the file has none of this
/// frame, or they were measured under other conditions and the request does not allow those.
const FrameCosts& replayedCosts(const SceneObject& scene, const Camera& camera,
                                const FrameRequest& request) {
    const CostSource& source = request.costs;
    const CostKey key{scene.scene().name, 0, request.run.frame.start};
    Experiment experiment = request.experiment;
    experiment.lightCount = scene.lightCount;
    experiment.lightSeed = scene.lightSeed;
    return findCosts(*source.table, source.path, key,
                     costConditions(scene.scene(), camera, experiment, request.timeSeconds),
                     request.allowsStaleCosts, pythonConsole(), "set allow_stale=True");
}

/// Renders as SingleFrames::render does: every frame depends on its inputs alone.
Object renderFrame(const std::shared_ptr<SceneObject>& scene, const py::dict& settings,
                   bool recordsPairs, const py::object& progress) {
    FrameRequest request = frameRequest(settings);
    auto frame = std::make_shared<FrameObject>();
    Call call("render by " + request.run.method, progress);
    runAlone(*scene, call, [&] {
        requireLights(*scene);
        Workspace& workspace = scene->workspace;
        if (request.run.usesEmbree() && workspace.backend() != Backend::kCpu)
            throw Error(ErrorKind::kUsage, "settings: \"method\" 'embree': rays of Embree run on "
                                           "the CPU; load the scene with backend='cpu'");
        ++scene->frameCount; // also where something fails below: what was there is gone
        if (request.experiment.camera != scene->view) // it forgets the renderers' buffers
            workspace.setView(request.experiment.camera, scene->scene().name);
        scene->view = request.experiment.camera;
        workspace.setTime(request.timeSeconds);
        RunParameters& run = request.run;
        run.frame.recordPairs = recordsPairs;
        run.frame.recordQuantities = recordsPairs;
        if (run.usesVoxels()) {
            const uint32_t log2 = request.experiment.resolutionLog2.front();
            workspace.dag(log2);
            run.resolution = 1u << log2;
        }
        refuseLods({run});
        if (request.costs.table || request.costs.calibration)
            for (const std::string& remark : remarksOn(request.costs, {run}))
                pythonConsole().note(remark);
        FrameRenderer& renderer = workspace.renderer(run);
        frame->camera = workspace.camera();
        frame->view = keyOf(frame->camera, request.timeSeconds, run.frame);
        if (request.model->needsCosts()) {
            renderer.reset();
            request.model->setCosts(request.costs.table
                                        ? replayedCosts(*scene, frame->camera, request)
                                        : costsOf(*scene, renderer, *frame, run));
        }
        frame->answers = pairResultsOf(
            renderFrom(renderer, frame->camera, *request.model, run.frame), renderer, run.frame);
        frame->number = scene->frameCount;
    });
    frame->scene = scene;
    frame->run = request.run;
    frame->exposure = request.experiment.exposure;
    frame->timeSeconds = request.timeSeconds;
    return frame;
}

void requireRecorded(const FrameObject& frame) {
    if (!frame.run.frame.recordPairs)
        throw Error(ErrorKind::kUsage, "the frame was rendered with record=False: it has no pairs");
}

/// Throws Error kUsage if the renderer has another frame now. Within runAlone.
void requireCurrent(const FrameObject& frame) {
    if (frame.number != frame.scene->frameCount)
        throw Error(ErrorKind::kUsage,
                    "the scene has rendered another frame since; ask for truth, judgement and "
                    "pairs of a frame before the next one, or render it again");
}

/// Returns Embree's results for the pairs of a frame. Within runAlone.
const std::vector<uint8_t>& truthOf(FrameObject& frame) {
    if (frame.truth)
        return *frame.truth;
    requireCurrent(frame);
    SceneObject& scene = *frame.scene;
    if (frame.view != scene.judgedView)
        scene.judge.forget();
    scene.judgedView = frame.view;
    frame.truth = scene.judge.truth(0, frame.answers.gbuffer, frame.answers.frame.pairs).visibility;
    return *frame.truth;
}

py::array truthArray(const Object& self, const py::object& progress) {
    requireRecorded(*self);
    Call call("Embree's answers", progress);
    runAlone(*self->scene, call, [&] { truthOf(*self); });
    return arrayOver(*self->truth, self);
}

py::dict judgeFrame(const Object& self, const py::object& progress) {
    requireRecorded(*self);
    Call call("explain errors", progress);
    std::string warning;
    runAlone(*self->scene, call, [&] {
        warning = fewPairsWarning(
            self->scene->scene().name, self->result().pairs.count(),
            {self->scene->lightCount >= 0, self->scene->workspace.isCameraAutomatic()});
        truthOf(*self);
        if (!self->report) {
            requireCurrent(*self);
            self->report = self->scene->judge.judge(0, self->answers);
        }
    });
    if (!warning.empty())
        pythonConsole().note("warning: " + warning);
    const ErrorReport& report = *self->report;
    Json counts = toJson(report.total);
    counts.update(nullRatesJson(report));
    Json perLight = Json::array();
    for (size_t light = 0; light < report.perLight.size(); ++light) {
        Json row = {{"light", light}};
        row.update(toJson(report.perLight[light]));
        perLight.push_back(std::move(row));
    }
    py::dict dict;
    dict["counts"] = toPython(counts);
    dict["per_light"] = toPython(perLight);
    dict["verdicts"] = arrayOver(reinterpret_cast<const uint8_t*>(report.verdicts.data()),
                                 {py::ssize_t(report.verdicts.size())}, self);
    dict["histogram"] = toPython(Json(report.visibilityHistogram));
    return dict;
}

py::dict tellPair(const Object& self, uint64_t pair, const py::object& progress) {
    requireRecorded(*self);
    if (pair >= self->result().pairs.count())
        throw py::index_error("pair " + std::to_string(pair) + ": the frame has " +
                              std::to_string(self->result().pairs.count()));
    Call call("explain a pair", progress);
    const Json told = runAlone(*self->scene, call, [&] {
        truthOf(*self);
        requireCurrent(*self);
        return pairReport(self->scene->workspace, self->run, self->answers, *self->truth, pair);
    });
    return toPython(told);
}

py::array colorOf(const Object& self) {
    const FrameOptions& options = self->run.frame;
    return arrayOver(reinterpret_cast<const float*>(self->result().color.data()),
                     {py::ssize_t(options.height), py::ssize_t(options.width), 3}, self);
}

py::array pictureOf(const Object& self, double exposure) {
    const std::vector<glm::vec3>& color = self->result().color;
    const double chosen = exposure > 0 ? exposure : self->exposure;
    const auto picture = std::make_shared<std::vector<glm::vec3>>();
    Call call("expose the picture", py::none());
    call.run([&] { *picture = toneMap(color, chosen > 0 ? float(chosen) : autoExposure(color)); });
    return arrayOver(reinterpret_cast<const float*>(picture->data()),
                     {py::ssize_t(self->run.frame.height), py::ssize_t(self->run.frame.width), 3},
                     picture);
}

/// Returns the frame as a run of results.json, without errors and times.
py::object runOf(const Object& self) {
    const std::string model = self->run.isRouted() ? self->run.model : "";
    Json json = {{"scene", self->scene->scene().name},
                 {"frame", 0},
                 {"method", self->run.method},
                 {"model", model},
                 {"parameters", self->run.toJson()},
                 {"label", self->run.label()},
                 {"camera_numbers", cameraText(self->camera)},
                 {"time_s", self->timeSeconds}};
    json.update(toJson(self->result().counts));
    json["pair_count"] = self->result().pairs.count();
    return toPython(json);
}

/// Returns what Timing says about the stages of several runs.
py::object timing(const py::list& runs) {
    Timing timing;
    for (const py::handle& run : runs) {
        StageTimes stages;
        for (const auto& [name, timeMs] : py::reinterpret_borrow<py::dict>(run))
            stages.add(py::str(name), timeMs.cast<double>());
        timing.add(stages);
    }
    if (timing.totalMs.empty())
        throw Error(ErrorKind::kUsage, "no run was timed; use repeats of 1 or more");
    return toPython(timing.toJson());
}

/// Adds the properties that are arrays.
template <class Class> void addArrays(Class& frame) {
    frame
        .def_property_readonly("color", &colorOf,
                               "Linear radiance, float32, (height, width, 3), read-only, without a "
                               "copy; row 0 is the top.")
        .def("picture", &pictureOf, py::arg("exposure") = 0.0,
             "Returns the colour exposed and tone mapped, float32 in [0, 1], (height, width, 3). "
             "exposure: 0 for the setting's, or an automatic one.")
        .def_property_readonly(
            "visibility",
            [](const Object& self) { return arrayOver(self->result().visibility, self); },
            "Visibility of each pair, uint8, (pairs,): 255 lit, 0 dark; below 128 a pair counts as "
            "dark. Read-only, without a copy.")
        .def_property_readonly(
            "light", [](const Object& self) { return arrayOver(self->result().pairs.light, self); },
            "Light of each pair, uint32, (pairs,), an index into Scene.lights.")
        .def_property_readonly(
            "first_pair",
            [](const Object& self) { return arrayOver(self->result().pairs.sampleStart, self); },
            "First pair of each pixel, uint64, (height * width + 1,): those of pixel i are "
            "first_pair[i] to first_pair[i + 1] - 1. Pixel x, y is y * width + x.")
        .def_property_readonly(
            "server",
            [](const Object& self) {
                const std::vector<PairServer>& servers = self->result().pairServer;
                py::array_t<uint8_t> by(static_cast<py::ssize_t>(servers.size()));
                std::transform(servers.begin(), servers.end(), by.mutable_data(),
                               [](PairServer server) { return uint8_t(server.by()); });
                return by;
            },
            "Which method computed each pair, uint8, (pairs,): an index into SERVERS.")
        .def_property_readonly(
            "maps", [](const Object& self) { return mapRows(self->result().maps); },
            "One row for each shadow map that the frame asks for, drawn or traced: a structured "
            "array of the quantities that cost models read, route (0 rays, 1 map) and pair_count.");
}

} // namespace

std::vector<std::string> verdictNames() {
    return {"right",   "explained", "unexplained", "acne",
            "contact", "magnified", "settled",     "tap_settled"};
}

std::vector<std::string> serverNames() {
    return {"rays", "map", "proof"};
}

void addFrame(py::module_& scope) {
    py::class_<FrameObject, Object> frame(
        scope, "Frame",
        "A frame of one method. Its arrays stay valid; truth, judge and pair need the frame to be "
        "the last one of its scene, or to have been asked before.");
    addArrays(frame);
    frame
        .def_property_readonly(
            "size",
            [](const FrameObject& self) {
                return py::make_tuple(self.run.frame.width, self.run.frame.height);
            },
            "Width and height, pixels.")
        .def_property_readonly(
            "label", [](const FrameObject& self) { return self.run.label(); },
            "The configuration, as results and legends name it.")
        .def_property_readonly("run", &runOf,
                               "The frame as a run of results.json: scene, method, model, "
                               "parameters, label, camera and counts.")
        .def_property_readonly(
            "counts",
            [](const FrameObject& self) { return toPython(toJson(self.result().counts)); },
            "Counts of the frame by name, as `shadowdag render --json` has them.")
        .def_property_readonly(
            "stages",
            [](const FrameObject& self) { return toPython(toJson(self.result().stages)); },
            "Times of the frame's stages by name, milliseconds.")
        .def_property_readonly(
            "time_ms", [](const FrameObject& self) { return self.result().stages.totalMs(); },
            "Sum of the stages, milliseconds.")
        .def_property_readonly(
            "wall_ms", [](const FrameObject& self) { return self.result().wallMs; },
            "Wall clock of the renderer, milliseconds, with the time outside of the stages.")
        .def_property_readonly(
            "lights",
            [](const FrameObject& self) { return toPython(lightsJson(self.result().maps)); },
            "One dict for each light with maps: light, route (rays, map or both), map_count, "
            "drawn_map_count, texels, face_texels, pages.")
        .def("truth", &truthArray, py::arg("progress") = py::none(),
             "Returns Embree's answer for each pair, uint8, (pairs,): 255 lit, 0 dark. Computed "
             "once for frames of one view in turn.")
        .def("judge", &judgeFrame, py::arg("progress") = py::none(),
             "Compares the frame with the truth, pair by pair. Returns a dict: counts and null "
             "rates as `shadowdag validate --json` has them; per_light, the same for each light; "
             "verdicts, uint8, (pairs,), indices into VERDICTS; histogram of visibilities.")
        .def("pair", &tellPair, py::arg("index"), py::arg("progress") = py::none(),
             "Returns a dict about one pair: pixel, light, world positions, what served it, what "
             "the method and the truth answer, and the blockers of both. Raises IndexError beyond "
             "the pairs.");
    scope.def("render", &renderFrame, py::arg("scene"), py::arg("settings"),
              py::arg("record") = true, py::arg("progress") = py::none(),
              "See shadowdag.Scene.frame.");
    scope.def("timing", &timing, py::arg("runs"),
              "Returns median, interval and stages of the stage times of several runs.");
    scope.def("frame_settings", &frameSettingTable,
              "Returns the settings that frames take: dicts with key, default and help.");
    scope.attr("VERDICTS") = py::tuple(py::cast(verdictNames()));
    scope.attr("SERVERS") = py::tuple(py::cast(serverNames()));
}

} // namespace shadowdag::python

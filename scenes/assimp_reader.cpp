// SPDX-License-Identifier: Apache-2.0
#include "scenes/assimp_reader.h"

#include "cuda/error.h"
#include "scenes/assimp_parser.h"
#include "scenes/gltf.h"
#include "scenes/limited_process.h"
#include "scenes/printable.h"
#include "scenes/scene_kind.h"

#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <new>

namespace shadowdag {

namespace {

/// Returns limits that sound files keep by a wide margin. Numbers of a text file take ten times
/// their digits while FBX is parsed, and compressed arrays a few times their bytes.
ProcessLimits assimpLimits(uint64_t fileBytes) {
    return {.memoryBytes = (uint64_t(256) << 20) + 160 * fileBytes,
            .cpuSeconds = 4 + (fileBytes >> 20) * 20,
            .outputBytes = glb::kMaxGlbBytes + (uint64_t(64) << 20)};
}

/// Appends values to bytes that readAssimpSource takes apart in the same order.
class Packer {
public:
    explicit Packer(const ByteSink& write) : write_(write) {}
    template <class List> void addList(const List& values) {
        const uint64_t count = values.size();
        write_(&count, sizeof count);
        write_(values.data(), count * sizeof(values[0]));
    }

private:
    const ByteSink& write_;
};

class Unpacker {
public:
    explicit Unpacker(const std::string& bytes) : bytes_(bytes) {}
    /// Takes a list; after one that does not fit the bytes, isWhole() is false.
    template <class List> void takeList(List& values) {
        uint64_t count = 0;
        take(&count, sizeof count);
        if (!isWhole_ || count > (bytes_.size() - at_) / sizeof(values[0])) {
            isWhole_ = false;
            return;
        }
        values.resize(count);
        take(values.data(), count * sizeof(values[0]));
    }
    bool isWhole() const { return isWhole_ && at_ == bytes_.size(); }

private:
    void take(void* to, size_t byteCount) {
        isWhole_ = isWhole_ && byteCount <= bytes_.size() - at_;
        if (!isWhole_ || byteCount == 0)
            return;
        std::memcpy(to, bytes_.data() + at_, byteCount);
        at_ += byteCount;
    }

    const std::string& bytes_;
    size_t at_ = 0;
    bool isWhole_ = true;
};

std::string joinedLines(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines)
        text += line + '\n';
    return text;
}

std::vector<std::string> linesOf(const std::string& text) {
    std::vector<std::string> lines;
    for (size_t at = 0, end; at < text.size(); at = end + 1) {
        end = std::min(text.find('\n', at), text.size());
        lines.push_back(printableLine(std::string_view(text).substr(at, end - at)));
    }
    return lines;
}

/// Runs in the process of its own.
int parseInto(const ByteSink& write, const std::string& path, const std::vector<uint8_t>& bytes,
              const std::string& extension) {
    const auto refuse = [&](ErrorKind kind, const std::string& message) {
        write(message.data(), message.size());
        return int(kind);
    };
    try {
        const GltfSource source = assimp::parse(path, bytes, extension);
        Packer packer(write);
        packer.addList(source.bytes);
        packer.addList(source.opacityMaps);
        packer.addList(joinedLines(source.warnings));
        return 0;
    } catch (const std::bad_alloc&) {
        return refuse(ErrorKind::kResource, "");
    } catch (const Error& error) {
        return refuse(error.kind(), error.what());
    }
}

Error refused(const std::string& path, const std::string& problem) {
    return Error(ErrorKind::kInput, path + ": " + problem + "; " + kHowToConvert);
}

/// Returns why the process gave no scene.
Error errorOf(const ProcessEnd& end, const ProcessLimits& limits, const std::string& path) {
    struct rlimit own {};
    getrlimit(RLIMIT_CPU, &own);
    const bool isHard = end.signal == SIGKILL && own.rlim_max == own.rlim_cur;
    if ((end.signal == SIGXCPU || isHard) && own.rlim_cur < limits.cpuSeconds)
        return Error(ErrorKind::kResource,
                     path + ": reading it took longer than the limit of the shell, " +
                         std::to_string(own.rlim_cur) + " s of processor time; raise it (ulimit " +
                         (isHard ? "-t)" : "-S -t)"));
    if (end.signal == SIGXCPU)
        return refused(path, "reading it took longer than the limit for a file of its size, " +
                                 std::to_string(limits.cpuSeconds) +
                                 " s of processor time; it is damaged");
    if (end.wroteTooMuch)
        return refused(path, "its content takes more than " +
                                 std::to_string(limits.outputBytes >> 20) + " MiB");
    if (end.signal == SIGKILL)
        return Error(ErrorKind::kResource, path + ": reading it was killed; is memory short?");
    for (const ErrorKind kind : {ErrorKind::kInput, ErrorKind::kResource})
        if (end.signal == 0 && end.status == int(kind) && !end.output.empty())
            return Error(kind, end.output);
    const bool isOutOfMemory = end.signal == 0 && end.status == int(ErrorKind::kResource);
    if (isOutOfMemory && !end.tighterMemoryLimit.empty())
        return Error(ErrorKind::kResource,
                     path +
                         ": reading it takes more memory than the limit of the shell; raise it (" +
                         end.tighterMemoryLimit + ")");
    if (isOutOfMemory)
        return refused(path,
                       "reading it takes more memory than the limit for a file of its size, " +
                           std::to_string(limits.memoryBytes >> 20) +
                           " MiB; it is damaged, or memory is short");
    const std::string how =
        end.signal != 0 ? std::string("crashed (") + strsignal(end.signal) + ")" : "failed";
    return refused(path, "reading it by Assimp " + how + "; it is damaged");
}

} // namespace

bool isReadByAssimp(const std::string& extension) {
    return extension != ".glb" && extension != ".gltf" && assimp::hasReader(extension);
}

Scene readByAssimp(const std::string& path, const std::vector<uint8_t>& bytes,
                   const std::string& extension) {
    const ProcessLimits limits = assimpLimits(bytes.size());
    ProcessEnd end = runInProcess(path, limits, [&](const ByteSink& write) {
        return parseInto(write, path, bytes, extension);
    });
    GltfSource source;
    std::string warnings;
    Unpacker unpacker(end.output);
    if (end.signal == 0 && end.status == 0) {
        unpacker.takeList(source.bytes);
        unpacker.takeList(source.opacityMaps);
        unpacker.takeList(warnings);
    }
    if (end.signal != 0 || end.status != 0 || !unpacker.isWhole())
        throw errorOf(end, limits, path);
    end.output = {};
    source.warnings = linesOf(warnings);
    return readGltf(path, std::move(source));
}

} // namespace shadowdag

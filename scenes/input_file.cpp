// SPDX-License-Identifier: Apache-2.0
#include "scenes/input_file.h"

#include "cuda/cancel.h"
#include "cuda/large_pages.h"
#include "scenes/warning.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace shadowdag {

namespace {

/// A descriptor that closes itself.
struct Descriptor {
    explicit Descriptor(int number) : fd(number) {}
    ~Descriptor() {
        if (fd >= 0)
            ::close(fd);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    const int fd;
};

std::string cannotBeOpened(int error) {
    return std::string("cannot be opened: ") + std::strerror(error);
}

/// Returns why a file of this status is not read; "" if it is.
std::string refusal(const struct stat& status, const InputLimits& limits) {
    if (S_ISDIR(status.st_mode))
        return "is a directory";
    if (S_ISFIFO(status.st_mode))
        return limits.mayBePipe ? "" : "is a pipe, where a regular file is read";
    if (S_ISSOCK(status.st_mode))
        return "is a socket";
    if (!S_ISREG(status.st_mode))
        return "is a device";
    if (uint64_t(status.st_size) > limits.maxBytes)
        return "has " + std::to_string(status.st_size) + " bytes; at most " +
               std::to_string(limits.maxBytes) + " are read";
    return "";
}

/// readInput, into a container of bytes.
template <class Bytes>
std::optional<Bytes> readInto(const std::string& path, const InputLimits& limits,
                              std::string& why) {
    // A name with a zero byte would open what is before it.
    const Descriptor file(path.find('\0') == std::string::npos
                              ? ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)
                              : (errno = ENOENT, -1));
    struct stat status {};
    if (file.fd < 0 || ::fstat(file.fd, &status) != 0) {
        const int error = errno;
        why = cannotBeOpened(error);
        refuseTooManyFiles(path, error);
        return std::nullopt;
    }
    why = refusal(status, limits);
    if (!why.empty())
        return std::nullopt;
    constexpr size_t kStep = size_t(1) << 20;
    Bytes content;
    content.reserve(size_t(status.st_size) + 1);
    useLargePages(content.data(), content.capacity());
    constexpr int kPollMs = 50;
    for (int waitedMs = 0;;) {
        if (limits.polls)
            pollCpu();
        // A pipe without a writer yet would be at its end; poll waits for the first.
        struct pollfd ready = {file.fd, POLLIN, 0};
        if (S_ISFIFO(status.st_mode) && ::poll(&ready, 1, kPollMs) <= 0) {
            waitedMs += kPollMs;
            if (limits.polls && content.empty() && waitedMs == 1000)
                warn(path + ": is a pipe into which nothing was written yet; waiting for its "
                            "writer");
            continue;
        }
        const size_t before = content.size();
        const size_t room =
            std::max<size_t>(content.capacity() - before, S_ISFIFO(status.st_mode) ? kStep : 1);
        content.resize(before + std::min(room, kStep));
        const ssize_t got = ::read(file.fd, content.data() + before, content.size() - before);
        const int error = errno;
        content.resize(before + size_t(std::max<ssize_t>(got, 0)));
        if (got == 0)
            return content;
        if (got < 0 && error == EAGAIN && !S_ISFIFO(status.st_mode)) {
            why = "behaves like a pipe with nothing to read yet; give a regular file";
            return std::nullopt;
        }
        if (got < 0 && error != EINTR && error != EAGAIN) {
            why = std::string("cannot be read: ") + std::strerror(error);
            return std::nullopt;
        }
        if (content.size() > limits.maxBytes) {
            why = "has more than the " + std::to_string(limits.maxBytes) + " bytes that are read";
            return std::nullopt;
        }
    }
}

} // namespace

std::optional<std::string> readInput(const std::string& path, const InputLimits& limits,
                                     std::string& why) {
    return readInto<std::string>(path, limits, why);
}

std::optional<std::vector<uint8_t>> readInputBytes(const std::string& path,
                                                   const InputLimits& limits, std::string& why) {
    return readInto<std::vector<uint8_t>>(path, limits, why);
}

std::string whyNoInput(const std::string& path, uint64_t maxBytes, bool mayBeEmpty) {
    struct stat status {};
    if (path.find('\0') != std::string::npos || ::stat(path.c_str(), &status) != 0)
        return cannotBeOpened(path.find('\0') != std::string::npos ? ENOENT : errno);
    const std::string why = refusal(status, {maxBytes});
    if (why.empty() && ::faccessat(AT_FDCWD, path.c_str(), R_OK, AT_EACCESS) != 0)
        return cannotBeOpened(errno);
    return why.empty() && status.st_size == 0 && !mayBeEmpty ? "has a size of 0 bytes" : why;
}

void refuseTooManyFiles(const std::string& path, int error) {
    if (error == EMFILE || error == ENFILE)
        throw TooManyFiles(ErrorKind::kResource,
                           path + ": " + cannotBeOpened(error) + "; " + kMoreFilesRemedy);
}

bool saysTooManyFiles(std::string_view said) {
    const std::string ofLoader = "open shared object file: Error " + std::to_string(EMFILE);
    return said.find(std::strerror(EMFILE)) != std::string_view::npos ||
           said.find(ofLoader) != std::string_view::npos;
}

std::ifstream openInput(const std::string& path) {
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file)
        refuseTooManyFiles(path, errno);
    return file;
}

} // namespace shadowdag

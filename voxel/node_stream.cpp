// SPDX-License-Identifier: Apache-2.0
#include "voxel/node_stream.h"

#include "cuda/error.h"
#include "scenes/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace shadowdag {
namespace {

constexpr size_t kBufferBytes = size_t(1) << 18;

/// Returns how many of the bytes at `offset` were read: less than `count` at the end of the file
/// only.
size_t readAt(int fd, uint64_t offset, void* data, size_t count, const std::string& name) {
    size_t done = 0;
    while (done < count) {
        const ssize_t got =
            ::pread(fd, static_cast<uint8_t*>(data) + done, count - done, off_t(offset + done));
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            throw Error(ErrorKind::kResource, name + ": cannot be read: " + std::strerror(errno) +
                                                  "; check the disk and try again");
        if (got == 0)
            break;
        done += size_t(got);
    }
    return done;
}

} // namespace

NodeReader::NodeReader(std::shared_ptr<const ReadableFile> file, uint64_t offset, uint32_t level,
                       const LevelCounts& counts, uint64_t childLimit)
    : file_(std::move(file)), offset_(offset), bytesLeft_(counts.byteCount(level)), level_(level),
      nodesLeft_(counts.nodeCount), childLimit_(childLimit),
      buffer_(size_t(std::min<uint64_t>(kBufferBytes, bytesLeft_))) {}

void NodeReader::fail(const std::string& what) const {
    throw Error(ErrorKind::kInput, file_->name() + ": level " + std::to_string(level_) + " " +
                                       what + "; the file is damaged, build it again");
}

const uint8_t* NodeReader::take(size_t count) {
    if (end_ - at_ < count) {
        const size_t rest = end_ - at_;
        if (count > rest + bytesLeft_)
            fail("ends inside a node");
        std::memmove(buffer_.data(), buffer_.data() + at_, rest);
        const size_t wanted = size_t(std::min<uint64_t>(buffer_.size() - rest, bytesLeft_));
        if (readAt(file_->fd(), offset_, buffer_.data() + rest, wanted, file_->name()) != wanted)
            fail("is cut off");
        offset_ += wanted;
        bytesLeft_ -= wanted;
        at_ = 0;
        end_ = rest + wanted;
    }
    at_ += count;
    return buffer_.data() + at_ - count;
}

bool NodeReader::next(NodeWords& node) {
    if (nodesLeft_ == 0) {
        if (bytesLeft_ != 0 || at_ != end_)
            fail("has more bytes than its nodes");
        return false;
    }
    --nodesLeft_;
    if (level_ == kLeafLog2) {
        std::memcpy(node.words, take(8), 8);
        node.count = 2;
        if (node.words[0] == 0 && node.words[1] == 0)
            fail("has an empty leaf");
        return true;
    }
    node.words[0] = *take(1);
    node.count = 1 + uint32_t(std::popcount(node.words[0]));
    if (node.count == 1)
        fail("has a node without a child");
    std::memcpy(node.words + 1, take(4 * (node.count - 1)), 4 * (node.count - 1));
    for (uint32_t i = 1; i < node.count; ++i)
        if (node.words[i] >= childLimit_)
            fail("names child " + std::to_string(node.words[i]) + " of " +
                 std::to_string(childLimit_));
    return true;
}

ReadableFile::ReadableFile(const std::string& path, const std::string& what)
    : name_(what + " " + path) {
    // Reading ends at the size that the file has here, so an empty one is harmless.
    if (const std::string why = whyNoInput(path, ~uint64_t(0), true); !why.empty())
        throw Error(ErrorKind::kInput, name_ + ": " + why + "; check the name and its permissions");
    fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK); // may be a pipe by now
    struct stat status {};
    if (fd_ < 0)
        refuseTooManyFiles(path, errno);
    if (fd_ < 0 || ::fstat(fd_, &status) != 0)
        throw Error(ErrorKind::kInput, name_ + ": cannot be opened: " + std::strerror(errno) +
                                           "; check the name and its permissions");
    if (!S_ISREG(status.st_mode)) {
        ::close(fd_);
        throw Error(ErrorKind::kInput, name_ + ": is not a regular file");
    }
    byteCount_ = uint64_t(status.st_size);
}

ReadableFile::~ReadableFile() {
    if (fd_ >= 0)
        ::close(fd_);
}

ReadableFile::ReadableFile(ReadableFile&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), byteCount_(other.byteCount_),
      name_(std::move(other.name_)) {}

ReadableFile& ReadableFile::operator=(ReadableFile&& other) noexcept {
    std::swap(fd_, other.fd_);
    std::swap(byteCount_, other.byteCount_);
    std::swap(name_, other.name_);
    return *this;
}

void ReadableFile::read(uint64_t offset, void* data, size_t count) const {
    if (readAt(fd_, offset, data, count, name_) != count)
        throw Error(ErrorKind::kInput, name_ + ": ends at byte " + std::to_string(byteCount_) +
                                           "; the file is cut off, copy or build it again");
}

} // namespace shadowdag

#include "schema/files/write_file.h"

#include "schema/files/program.h"
#include "schema/mapped_file.h"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace keratin {

namespace {

Error io_error(const std::string& path, const char* what, int code) {
    return {ErrorCode::io, path, std::string(what) + ": " + std::generic_category().message(code)};
}

// Paths of temporary files for a signal handler, which may neither allocate nor lock.
constexpr std::size_t kMostPending = 32, kLongestPath = 4096;
struct PendingPath {
    std::atomic<int> state{0};  // 0: free, 1: being filled in, 2: to be removed
    char path[kLongestPath];
};
PendingPath pending_paths[kMostPending];

void remember(const std::string& path) {
    if (path.size() >= kLongestPath) return;
    for (PendingPath& slot : pending_paths) {
        int expected = 0;
        if (!slot.state.compare_exchange_strong(expected, 1)) continue;
        std::memcpy(slot.path, path.c_str(), path.size() + 1);
        slot.state = 2;
        return;
    }
}

void forget(const std::string& path) {
    for (PendingPath& slot : pending_paths)
        if (slot.state == 2 && path == slot.path) slot.state = 0;
}

}  // namespace

void remove_pending_files() {
    for (PendingPath& slot : pending_paths)
        if (slot.state == 2) ::unlink(slot.path);
}

Result<PendingFile> PendingFile::create(const std::string& path) {
    namespace fs = std::filesystem;
    PendingFile pending;
    std::error_code ignored;
    const fs::path followed =
        fs::is_symlink(path, ignored) ? fs::weakly_canonical(path, ignored) : fs::path(path);
    pending.path_ = followed.string();
    if (fs::is_directory(path, ignored))
        return Error{ErrorCode::io, path, "cannot write: it is a folder"};
    // A pipe behind a link (/dev/stdout) has no path of its own to follow it to.
    if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
        pending.path_ = path;
        pending.temporary_ = path;
        pending.file_ = ::open(pending.path_.c_str(), O_WRONLY | O_CLOEXEC);
    } else {
        pending.temporary_ = pending.path_ + ".XXXXXX";
        pending.file_ = ::mkstemp(pending.temporary_.data());
        if (pending.file_ >= 0) {
            remember(pending.temporary_);
            // mkstemp makes the file private; give it what the old file or the umask says.
            struct stat status {};
            const mode_t mask = ::umask(0);
            ::umask(mask);
            const bool existed = ::stat(pending.path_.c_str(), &status) == 0;
            ::fchmod(pending.file_, existed ? status.st_mode & 07777 : 0666 & ~mask);
        }
    }
    if (pending.file_ < 0) {
        const int code = errno;
        pending.temporary_ = pending.path_;
        return io_error(path, "cannot write", code);
    }
    return pending;
}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      file_(std::exchange(other.file_, -1)) {}

PendingFile& PendingFile::operator=(PendingFile&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(temporary_, other.temporary_);
    std::swap(file_, other.file_);
    return *this;
}

PendingFile::~PendingFile() {
    if (file_ < 0) return;
    ::close(file_);
    if (temporary_ != path_) ::unlink(temporary_.c_str());
    forget(temporary_);
}

Result<void> PendingFile::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(file_, bytes.data(), bytes.size());
        if (written < 0) {
            if (errno == EINTR) continue;
            return io_error(path_, "cannot write", errno);
        }
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return {};
}

Result<void> PendingFile::write(std::string_view text) {
    return write(std::as_bytes(std::span(text.data(), text.size())));
}

Result<void> PendingFile::overwrite(std::size_t offset, std::span<const std::byte> bytes) {
    const ssize_t written = ::pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written != static_cast<ssize_t>(bytes.size()))
        return io_error(path_, "cannot write", errno);
    return {};
}

Result<void> PendingFile::commit() {
    const int file = std::exchange(file_, -1);
    const auto fail = [&](const char* what) -> Result<void> {
        const int code = errno;
        if (temporary_ != path_) ::unlink(temporary_.c_str());
        forget(temporary_);
        return io_error(path_, what, code);
    };
    if (::close(file) != 0) return fail("cannot write");
    if (temporary_ != path_ && std::rename(temporary_.c_str(), path_.c_str()) != 0)
        return fail("cannot replace");
    forget(temporary_);
    return {};
}

Result<void> write_file(const std::string& path, std::span<const std::byte> bytes) {
    auto file = PendingFile::create(path);
    if (!file) return file.error();
    if (auto ok = file->write(bytes); !ok) return ok;
    return file->commit();
}

Result<void> write_file(const std::string& path, std::string_view text) {
    return write_file(path, std::as_bytes(std::span(text.data(), text.size())));
}

Result<std::vector<std::byte>> read_file(const std::string& path) {
    auto file = MappedFile::open(path);
    if (!file) return file.error();
    return std::vector<std::byte>(file->bytes().begin(), file->bytes().end());
}

}  // namespace keratin

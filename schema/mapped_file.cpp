#include "schema/mapped_file.h"

#include <system_error>
#include <utility>

#ifdef _WIN32
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
#else
#include <cerrno>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace keratin {

namespace {

Error io_error(const std::string& path, const char* what, int code) {
    return {ErrorCode::io, path, std::string(what) + ": " + std::system_category().message(code)};
}

Error empty_error(const std::string& path) { return {ErrorCode::input, path, "the file is empty"}; }

}  // namespace

#ifdef _WIN32

Result<MappedFile> MappedFile::open(const std::string& path) {
    const HANDLE file = CreateFileA(path.c_str(), GENERIC_READ, FILE_SHARE_READ, nullptr,
                                    OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, nullptr);
    if (file == INVALID_HANDLE_VALUE)
        return io_error(path, "cannot open", static_cast<int>(GetLastError()));
    LARGE_INTEGER size{};
    if (!GetFileSizeEx(file, &size)) {
        const int code = static_cast<int>(GetLastError());
        CloseHandle(file);
        return io_error(path, "cannot read its size", code);
    }
    if (size.QuadPart == 0) {
        CloseHandle(file);
        return empty_error(path);
    }
    const HANDLE mapping = CreateFileMappingA(file, nullptr, PAGE_READONLY, 0, 0, nullptr);
    CloseHandle(file);
    if (!mapping) return io_error(path, "cannot map", static_cast<int>(GetLastError()));
    const void* data = MapViewOfFile(mapping, FILE_MAP_READ, 0, 0, 0);
    const int code = static_cast<int>(GetLastError());
    CloseHandle(mapping);
    if (!data) return io_error(path, "cannot map", code);
    return MappedFile(
        {static_cast<const std::byte*>(data), static_cast<std::size_t>(size.QuadPart)});
}

MappedFile::~MappedFile() {
    if (bytes_.data()) UnmapViewOfFile(bytes_.data());
}

#else

Result<MappedFile> MappedFile::open(const std::string& path) {
    // Non-blocking, so that a named pipe is refused below instead of waited for.
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) return io_error(path, "cannot open", errno);
    struct stat status {};
    if (::fstat(file, &status) != 0) {
        const int code = errno;
        ::close(file);
        return io_error(path, "cannot read its size", code);
    }
    if (!S_ISREG(status.st_mode)) {
        ::close(file);
        return Error{ErrorCode::io, path, "not a regular file"};
    }
    const auto size = static_cast<std::size_t>(status.st_size);
    if (size == 0) {
        ::close(file);
        return empty_error(path);
    }
    void* data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
    const int code = errno;
    ::close(file);
    if (data == MAP_FAILED) return io_error(path, "cannot map", code);
    return MappedFile({static_cast<const std::byte*>(data), size});
}

MappedFile::~MappedFile() {
    if (bytes_.data()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

#endif

MappedFile::MappedFile(MappedFile&& other) noexcept : bytes_(std::exchange(other.bytes_, {})) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
    std::swap(bytes_, other.bytes_);
    return *this;
}

}  // namespace keratin

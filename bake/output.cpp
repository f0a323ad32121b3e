#include "bake/output.h"

#include "schema/files/write_file.h"
#include "schema/mapped_file.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>

namespace keratin {
namespace {

// Make's escapes, which Ninja reads as well: a backslash before a space or '#', and '$' doubled.
std::string escaped(const std::string& path) {
    std::string out;
    for (char c : path) {
        if (c == ' ' || c == '#') out += '\\';
        if (c == '$') out += '$';
        out += c;
    }
    return out;
}

}  // namespace

Result<bool> write_if_changed(const std::string& path, std::span<const std::byte> bytes,
                              Unchanged unchanged) {
    namespace fs = std::filesystem;
    std::error_code failed;
    if (fs::is_regular_file(path, failed) && fs::file_size(path, failed) == bytes.size()) {
        const auto old = MappedFile::open(path);
        if (old && old->bytes().size() == bytes.size() &&
            std::memcmp(old->bytes().data(), bytes.data(), bytes.size()) == 0) {
            if (unchanged == Unchanged::touch) {
                fs::last_write_time(path, fs::file_time_type::clock::now(), failed);
                if (failed)
                    return Error{ErrorCode::io, path, "cannot set its time: " + failed.message()};
            }
            return false;
        }
    }
    if (auto ok = write_file(path, bytes); !ok) return ok.error();
    return true;
}

std::string dependency_text(const std::string& output, std::span<const std::string> inputs) {
    std::vector<std::string> paths;
    for (const std::string& input : inputs) {
        paths.push_back(std::filesystem::absolute(input).lexically_normal().string());
    }
    std::sort(paths.begin(), paths.end());
    paths.erase(std::unique(paths.begin(), paths.end()), paths.end());
    std::string out = escaped(output) + ":";
    for (const std::string& path : paths) out += " \\\n  " + escaped(path);
    return out + "\n";
}

}  // namespace keratin

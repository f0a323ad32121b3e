#include "tools/keratin-view/film.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <unistd.h>
#include <utility>

namespace keratin::view {
namespace {

bool installed(const std::string& program) {
    const char* folders = std::getenv("PATH");
    std::istringstream list(folders ? folders : "");
    for (std::string folder; std::getline(list, folder, ':');)
        if (access((folder + "/" + program).c_str(), X_OK) == 0) return true;
    return false;
}

std::string quoted(const std::string& text) {
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

}  // namespace

Result<Film> Film::create(const std::string& path, int width, int height,
                          double frames_per_second) {
    const std::filesystem::path target(path);
    if (!target.has_extension())
        return Error{ErrorCode::usage, path, "a film needs an ending, such as film.mp4"};
    if (!installed("ffmpeg"))
        return Error{ErrorCode::unsupported, path,
                     "films need ffmpeg (apt-get install ffmpeg); --sheet 12 gives a contact sheet "
                     "without it"};
    Film film;
    film.path_ = path;
    // The ending stays last: ffmpeg goes by it.
    film.temporary_ =
        (target.parent_path() / ("." + target.stem().string() + "." + std::to_string(getpid()) +
                                 target.extension().string()))
            .string();
    std::ostringstream command;
    // Most codecs want even sides.
    command << "ffmpeg -loglevel error -y -f rawvideo -pix_fmt rgb24 -s " << width << 'x' << height
            << " -r " << frames_per_second
            << " -i - -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' -pix_fmt yuv420p "
            << quoted(std::filesystem::absolute(film.temporary_).string()) << " >/dev/null";
    std::signal(SIGPIPE, SIG_IGN);  // a codec that gives up shows as a failed write
    film.pipe_ = popen(command.str().c_str(), "w");
    if (!film.pipe_) return Error{ErrorCode::io, path, "ffmpeg cannot be started"};
    return film;
}

Film::Film(Film&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      pipe_(std::exchange(other.pipe_, nullptr)) {}

Film::~Film() {
    if (!pipe_) return;
    pclose(pipe_);
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
}

Result<void> Film::add(const Image& image) {
    if (std::fwrite(image.rgb.data(), 1, image.rgb.size(), pipe_) != image.rgb.size())
        return Error{ErrorCode::io, path_, "ffmpeg takes no more pictures"};
    return {};
}

Result<void> Film::finish() {
    const int status = pclose(std::exchange(pipe_, nullptr));
    std::error_code failed;
    if (status == 0) std::filesystem::rename(temporary_, path_, failed);
    if (status != 0 || failed) {
        std::error_code ignored;
        std::filesystem::remove(temporary_, ignored);
        return Error{ErrorCode::io, path_,
                     "the film cannot be written (ffmpeg's message stands above)"};
    }
    return {};
}

}  // namespace keratin::view

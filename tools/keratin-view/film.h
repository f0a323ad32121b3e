// A film from pictures, by the program ffmpeg where it is installed.
#pragma once

#include "schema/result.h"
#include "tools/keratin-view/image.h"

#include <cstdio>
#include <string>

namespace keratin::view {

// Pictures handed over one by one; the file takes its place when finish() succeeds.
class Film {
  public:
    // The ending of `path` chooses the format (mp4, webm, gif, ...). Errors: unsupported when
    // ffmpeg is not installed; usage when the path has no ending.
    static Result<Film> create(const std::string& path, int width, int height,
                               double frames_per_second);
    Film(Film&& other) noexcept;
    Film& operator=(Film&&) = delete;
    ~Film();

    Result<void> add(const Image& image);
    Result<void> finish();

  private:
    Film() = default;
    std::string path_, temporary_;
    std::FILE* pipe_ = nullptr;
};

}  // namespace keratin::view

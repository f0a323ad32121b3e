#include "tools/keratin-bench/programs.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/wait.h>
#include <vector>

namespace keratin::bench {

namespace {

namespace fs = std::filesystem;

double children_seconds() {
    rusage usage{};
    getrusage(RUSAGE_CHILDREN, &usage);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

constexpr double kRadius = 0.1, kLength = 0.2;  // m
constexpr std::uint32_t kPoints = 16;

void write_ball(const std::string& path) {
    constexpr int kRings = 64, kAround = 128;
    std::ofstream out(path);
    for (int i = 0; i <= kRings; ++i)
        for (int j = 0; j < kAround; ++j) {
            const double theta = std::numbers::pi * i / kRings;
            const double phi = 2 * std::numbers::pi * j / kAround;
            out << "v " << kRadius * std::sin(theta) * std::cos(phi) << ' '
                << kRadius * std::cos(theta) << ' ' << kRadius * std::sin(theta) * std::sin(phi)
                << '\n';
        }
    const auto at = [&](int i, int j) { return i * kAround + j % kAround + 1; };
    for (int i = 0; i < kRings; ++i)
        for (int j = 0; j < kAround; ++j) {
            if (i > 0) out << "f " << at(i, j) << ' ' << at(i, j + 1) << ' ' << at(i + 1, j) << '\n';
            if (i + 1 < kRings)
                out << "f " << at(i, j + 1) << ' ' << at(i + 1, j + 1) << ' ' << at(i + 1, j)
                    << '\n';
        }
}

// Version 3 of the format: an offset of 0 means that the field is absent.
void write_tfx(const std::string& path, std::uint32_t strands, std::uint32_t moved_every) {
    constexpr std::size_t kHeaderBytes = 296, kPositionOffsetAt = 144;
    std::vector<char> header(kHeaderBytes, 0);
    const auto put = [&](std::size_t at, auto value) {
        std::memcpy(header.data() + at, &value, sizeof value);
    };
    put(0, 3.0f);
    put(4, strands);
    put(8, kPoints);
    put(kPositionOffsetAt, std::uint32_t{kHeaderBytes});
    std::ofstream out(path, std::ios::binary);
    out.write(header.data(), kHeaderBytes);
    std::vector<float> points(3 * kPoints);
    for (std::uint32_t s = 0; s < strands; ++s) {
        const double up = 1 - 2 * (double(s) + 0.5) / double(strands);
        const double turn = 2.399963229728653 * double(s), flat = std::sqrt(1 - up * up);
        const double d[3] = {flat * std::cos(turn), up, flat * std::sin(turn)};
        const double aside = moved_every > 0 && s % moved_every == 0 ? 1e-4 : 0;
        for (std::uint32_t p = 0; p < kPoints; ++p) {
            const double t = double(p) / (kPoints - 1), wave = 0.01 * t * std::sin(12 * t + turn);
            points[3 * p] = float(d[0] * (kRadius + kLength * t) + wave + aside);
            points[3 * p + 1] = float(d[1] * (kRadius + kLength * t) - kLength * t * t / 2);
            points[3 * p + 2] = float(d[2] * (kRadius + kLength * t) + wave);
        }
        out.write(reinterpret_cast<const char*>(points.data()),
                  std::streamsize(points.size() * sizeof(float)));
    }
    if (!out) throw std::runtime_error(path + ": cannot be written; is the disk full?");
}

}  // namespace

Scratch::Scratch() {
    std::string name = (fs::temp_directory_path() / "keratin_bench.XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error(name + ": cannot make this folder");
    path_ = name;
}

Scratch::~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

Ran run_program(const std::string& name, const std::string& arguments, int highest_code) {
    const std::string program = (fs::read_symlink("/proc/self/exe").parent_path() / name).string();
    const std::string command = "'" + program + "' " + arguments;
    const double before = children_seconds();
    FILE* pipe = popen(command.c_str(), "r");
    if (!pipe) throw std::runtime_error(command + ": cannot be run");
    Ran ran;
    char text[4096];
    for (std::size_t n; (n = std::fread(text, 1, sizeof text, pipe)) > 0;) ran.out.append(text, n);
    const int status = pclose(pipe);
    if (!WIFEXITED(status) || WEXITSTATUS(status) > highest_code)
        throw std::runtime_error(command + ": failed");
    ran.cpu_seconds = children_seconds() - before;
    return ran;
}

std::string write_groom(const Scratch& folder, const std::string& name, std::uint32_t strands,
                        std::uint32_t moved_every) {
    write_ball(folder / "ball.obj");
    write_tfx(folder / (name + ".tfx"), strands, moved_every);
    const std::string recipe = folder / (name + ".json");
    std::ofstream(recipe) << "{ \"curves\": [ { \"file\": \"" << name
                          << ".tfx\" } ], \"mesh\": { \"file\": \"ball.obj\" } }\n";
    return recipe;
}

}  // namespace keratin::bench

#include "schema/files/program.h"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#ifdef __linux__
#include <unistd.h>
#endif

namespace keratin {

namespace {

namespace fs = std::filesystem;

bool is_special(const std::string& path) {
    std::error_code ignored;
    return fs::exists(path, ignored) && !fs::is_regular_file(path, ignored);
}

bool is_same_file(const std::string& a, const std::string& b) {
    std::error_code failed;
    if (fs::equivalent(a, b, failed) && !failed) return true;
    // Neither may be there yet.
    const fs::path full_a = fs::weakly_canonical(fs::absolute(a, failed), failed);
    const fs::path full_b = fs::weakly_canonical(fs::absolute(b, failed), failed);
    return !full_a.empty() && full_a == full_b;
}

}  // namespace

Result<void> check_outputs(std::span<const OutputFile> outputs,
                           std::span<const std::string> inputs) {
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const OutputFile& output = outputs[i];
        if (output.path.empty() || is_special(output.path)) continue;
        for (std::size_t k = 0; k < i; ++k)
            if (!outputs[k].path.empty() && is_same_file(output.path, outputs[k].path))
                return Error{ErrorCode::input, output.path,
                             output.option + " and " + outputs[k].option +
                                 " name the same file; give each a name of its own"};
        for (const std::string& input : inputs)
            if (is_same_file(output.path, input))
                return Error{ErrorCode::input, output.path,
                             output.option + " would overwrite what is read; give it another name"};
    }
    return {};
}

void wait_sleeping([[maybe_unused]] char** arguments) {
#ifdef __linux__
    if (std::getenv("OMP_WAIT_POLICY") || std::getenv("GOMP_SPINCOUNT")) return;
    // Some microseconds.
    setenv("GOMP_SPINCOUNT", "1000", 1);
    // By its own name, which lists of processes show.
    std::error_code error;
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
    if (!error) execv(self.c_str(), arguments);
#endif
}

Result<void> finish_stdout() {
    errno = 0;
    if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return {};
    // An earlier write that failed has left a mark, but not its reason.
    const std::string reason =
        errno == 0 ? "not all that was printed arrived" : std::generic_category().message(errno);
    return Error{ErrorCode::io, "stdout", "cannot write: " + reason};
}

namespace {

extern "C" void end_by_signal(int number) {
    remove_pending_files();
    std::signal(number, SIG_DFL);
    std::raise(number);
}

}  // namespace

void leave_nothing_behind() {
    for (const int number : {SIGINT, SIGTERM, SIGHUP})
        if (std::signal(number, end_by_signal) == SIG_IGN) std::signal(number, SIG_IGN);
}

std::function<std::string(const std::string&)> number_between(double low, double high) {
    return [low, high](const std::string& text) -> std::string {
        double value = 0;
        const char *begin = text.data(), *end = begin + text.size();
        if (begin != end && *begin == '+') ++begin;
        const auto [last, code] = std::from_chars(begin, end, value);
        if (code == std::errc() && last == end && std::isfinite(value) && value >= low &&
            value <= high)
            return "";
        char range[64];
        std::snprintf(range, sizeof range, "%.9g to %.9g", low, high);
        return "'" + text + "' is not a number from " + range;
    };
}

}  // namespace keratin

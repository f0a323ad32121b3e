#include "schema/files/program.h"

#include "schema/files/write_file.h"
#include "tests/temporary_folder.h"

#include <catch2/catch.hpp>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sys/wait.h>
#include <unistd.h>

using namespace keratin;
namespace fs = std::filesystem;

namespace {

std::string message(const std::vector<OutputFile>& outputs,
                    const std::vector<std::string>& inputs) {
    const auto ok = check_outputs(outputs, inputs);
    return ok ? "" : to_string(ok.error());
}

}  // namespace

TEST_CASE("an output that is an input, by any name, is refused") {
    const test::TemporaryFolder folder;
    const std::string input = folder.write("in.json", "{}");
    fs::create_symlink(input, folder.file("link"));
    fs::create_directory(folder.file("sub"));
    const std::string expected = ": -o would overwrite what is read; give it another name";
    for (const std::string& name :
         {input, folder.file("./in.json"), folder.file("sub/../in.json"), folder.file("link")})
        CHECK(message({{"-o", name}}, {input}) == name + expected);
    CHECK(message({{"-o", folder.file("out.kera")}}, {input}).empty());
    // Nor may two outputs be one file, there yet or not.
    const std::string out = folder.file("new");
    CHECK(message({{"-o", out}, {"--sarif", folder.file("sub/../new")}}, {})
              .find("--sarif and -o name the same file") != std::string::npos);
    CHECK(message({{"-o", "/dev/null"}, {"--sarif", "/dev/null"}, {"--depfile", ""}}, {}).empty());
}

TEST_CASE("numbers of options are numbers") {
    const auto check = number_between(1e-9, 100);
    for (const char* good : {"1", "1e-9", "+2.5", "100"}) CHECK(check(good).empty());
    for (const char* bad : {"nan", "inf", "-1", "0", "100.1", "", "1x", " 1", "0x1", "1e999"}) {
        INFO(bad);
        CHECK(check(bad) == "'" + std::string(bad) + "' is not a number from 1e-09 to 100");
    }
}

TEST_CASE("what is printed to a full disk is an error") {
    const pid_t child = fork();
    if (child == 0) {
        if (!std::freopen("/dev/full", "w", stdout)) _exit(9);
        std::printf("lost");
        const auto ok = finish_stdout();
        _exit(!ok && to_string(ok.error()) == "stdout: cannot write: No space left on device" ? 0
                                                                                              : 1);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
}

TEST_CASE("a program that is stopped leaves nothing half-written") {
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
        const test::TemporaryFolder folder;
        int ready[2];
        REQUIRE(pipe(ready) == 0);
        const pid_t child = fork();
        if (child == 0) {
            leave_nothing_behind();
            auto file = PendingFile::create(folder.file("out"));
            auto given_up = PendingFile::create(folder.file("other"));
            if (!file || !given_up || !file->write("half")) _exit(9);
            (void)!write(ready[1], "!", 1);
            for (;;) pause();
        }
        char byte = 0;
        REQUIRE(read(ready[0], &byte, 1) == 1);
        CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 2);
        REQUIRE(kill(child, number) == 0);
        int status = 0;
        REQUIRE(waitpid(child, &status, 0) == child);
        CHECK(WIFSIGNALED(status));
        CHECK(WTERMSIG(status) == number);
        CHECK(fs::is_empty(folder.path()));
        close(ready[0]);
        close(ready[1]);
    }
}

TEST_CASE("a pipe behind a link is written to") {
    const test::TemporaryFolder folder;
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    const std::string link = folder.file("link");
    fs::create_symlink("/proc/self/fd/" + std::to_string(ends[1]), link);
    CHECK(write_file(link, std::string_view("through")));
    char text[8] = {};
    CHECK(read(ends[0], text, 7) == 7);
    CHECK(std::string(text) == "through");
    close(ends[0]);
    close(ends[1]);
}

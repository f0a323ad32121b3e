// Runs a program and keeps what it said.
#pragma once

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <sys/wait.h>

namespace keratin::test {

inline std::string content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

struct Outcome {
    int code = -1;  // -1: ended by a signal
    std::string out, err;
};

// The folder takes the files stdout and stderr.
template <class Folder>
Outcome run_program(const Folder& folder, const std::string& program,
                    const std::string& arguments) {
    const std::string out = folder.file("stdout"), err = folder.file("stderr");
    const int status =
        std::system(("'" + program + "' " + arguments + " >" + out + " 2>" + err).c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content(out), content(err)};
}

}  // namespace keratin::test

// For sections that measure whole programs: running them, and grooms as files.
#pragma once

#include <cstdint>
#include <string>

namespace keratin::bench {

// A folder for the files of a section, removed with everything in it at the end.
class Scratch {
  public:
    Scratch();
    ~Scratch();
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    std::string operator/(const std::string& name) const { return path_ + "/" + name; }

  private:
    std::string path_;
};

struct Ran {
    double cpu_seconds = 0;  // of all its threads, loading included
    std::string out;
};

// Runs one of keratin's programs, found beside this one, with arguments that need no quoting.
// Throws when its exit code is above `highest_code`.
Ran run_program(const std::string& name, const std::string& arguments, int highest_code = 0);

// Hair on a ball of 10 cm: roots on a golden spiral, 16 points a strand over 20 cm of waves that
// fall. Writes ball.obj (16 256 triangles), NAME.tfx and NAME.json, whose path is returned.
// Every `moved_every`-th strand stands 0.1 mm aside; 0: none.
std::string write_groom(const Scratch& folder, const std::string& name, std::uint32_t strands,
                        std::uint32_t moved_every = 0);

}  // namespace keratin::bench

// The simulated points as a table for other programs: frame,time,strand,point,x,y,z.
#pragma once

#include "runtime/run/solver_run.h"
#include "schema/files/write_file.h"

namespace keratin {

class PointsCsv {
  public:
    static Result<PointsCsv> create(const std::string& path);
    // One line a simulated point, 9 significant digits or more.
    Result<void> add(std::uint64_t frame, double time, const RunLayout& layout,
                     const RunState& state);
    Result<void> finish() { return file_.commit(); }

  private:
    explicit PointsCsv(PendingFile file) : file_(std::move(file)) {}
    PendingFile file_;
};

}  // namespace keratin

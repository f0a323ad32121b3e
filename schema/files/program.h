// What every program owes its caller, whatever it computes: outputs that never eat inputs, a word
// when what it printed did not arrive, nothing half-written when it is stopped, and numbers on the
// command line that are numbers.
#pragma once

#include "schema/result.h"

#include <functional>
#include <span>
#include <string>

namespace keratin {

// A file that a program is asked to write, by the option that says so; an empty path: not asked
// for.
struct OutputFile {
    std::string option, path;
};

// Error (input) when two outputs are the same file, or an output is one of the files that the
// program reads. What is no regular file (/dev/null, a pipe) may be named twice.
Result<void> check_outputs(std::span<const OutputFile> outputs,
                           std::span<const std::string> inputs);

// To be called after the last word. Error (io) when what was printed did not arrive: a full disk,
// for example.
Result<void> finish_stdout();

// From now on a signal that ends the program (SIGINT, SIGTERM, SIGHUP) also takes away the
// temporary files of outputs that are not finished.
void leave_nothing_behind();

// What the signals' handler does: takes away what all pending files (schema/files/write_file.h)
// that are neither committed nor given up have written so far. Safe in a signal handler, after
// which the program must end.
void remove_pending_files();

// To be called first in main. Has threads that wait for each other sleep soon. libgomp's wait in a
// spin for milliseconds, which the rod solver's many short loops make ten times slower than one thread
// where other programs take the cores. It reads its settings when it is loaded, so the program starts
// itself anew with them. What the environment says of OMP_WAIT_POLICY or GOMP_SPINCOUNT stays; nothing
// happens on other systems than Linux.
void wait_sleeping(char** arguments);

// For CLI11's Option::check: says what is wrong with the text of an option that must be a number
// from `low` to `high`; empty if nothing is.
std::function<std::string(const std::string&)> number_between(double low, double high);

}  // namespace keratin

// Finds the contacts of a time step: all pairs of edges, and edges with colliders, that come within
// their contact distance while everything moves linearly from x_t0 to x_t1 (METHODS 2.8).
#pragma once

#include "runtime/contact/broad_phase.h"
#include "runtime/contact/contact.h"

#include <memory>
#include <span>
#include <vector>

namespace keratin {

struct DetectionSettings {
    double step = 1e-3;           // s
    double friction = 0.3;        // strand on strand, >= 0 (infinite allowed)
    double contact_distance = 0;  // m, strand on strand; 0: r1 + r2
    bool between_strands = true;
    // A contact whose distance at the end of the step falls short of delta by more than this share
    // has its normal and points taken anew there (refresh_contacts).
    double end_tolerance = 3e-3;
    int threads = 1;
    InstructionSet instruction_set = InstructionSet::automatic;  // of the search
};

// A contact as found, placed by its first moment.
struct FoundContact {
    Contact contact;
    double time = 0;     // 0..1, first moment of contact
    bool moved = false;  // found at the end of the edge before the one it is filed under
};

// Keeps its memory from call to call. The list depends on the input only, not on threads.
class Detection {
  public:
    Detection();
    ~Detection();
    Detection(Detection&&) noexcept;
    Detection& operator=(Detection&&) noexcept;

    // Contacts between x_t0 and x_t1, ascending by key, each key once. Within one step, pass
    // `again = true` after the first call: pairs near each other are then looked for only where the
    // strands have moved farther than the first call allowed for.
    std::span<const FoundContact> find(const ContactStrands& strands,
                                       std::span<const MovingShape> colliders,
                                       const DetectionSettings& settings, bool again = false);

    // Pairs of strands' edges, of those that the last find looked at, that end the step nearer than
    // delta and than they begin it by more than kOverlaps of delta; whether or not they have a
    // contact: one that holds at its place says nothing of the rest of its edges.
    std::size_t overlapping(const ContactStrands& strands, const DetectionSettings& settings) const;

  private:
    struct Memory;
    std::unique_ptr<Memory> memory_;
};

}  // namespace keratin

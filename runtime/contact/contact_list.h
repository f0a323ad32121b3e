// The contacts of a time step as a list, ascending by key, that goes on from detection to
// detection.
#pragma once

#include "runtime/contact/detection.h"

#include <cstddef>
#include <span>
#include <vector>

namespace keratin {

// Adds what was found to the list of the step, which stays ascending by key: new contacts with
// impulse 0; contacts already there, by their key or, inside an edge on a round solid, by their
// place (meeting.h), keep what they have. Returns how many were added.
std::size_t merge_contacts(std::span<const FoundContact> found, std::vector<Contact>& contacts);

// Contacts of neighbouring edges that stand at one place, whichever way they came to do so (sliding
// takes a contact to the end of its edge, beside that of the next edge), are made one, which keeps
// the impulse of both: two would share the load in no particular way, and a solve that is after it
// would take long. Returns how many of the contacts that the last merge added went.
struct United {
    std::size_t fresh = 0, all = 0;  // went
};
United unite_contacts(const ContactStrands& strands, std::vector<Contact>& contacts);

// The contact law holds along one normal a contact, through one pair of material points. Where the
// strands slide and turn so much in one step that they end nearer than delta by more than
// end_tolerance, normal and points are taken anew from x_t1; the impulse stays. **Beyond** METHODS
// 2.8: without it 1 mm of sliding at 10 rad/s leaves 10 % of delta as overlap. A contact is taken
// anew a few times a step: strands that turn past each other by many radii would turn their contact
// for ever. Returns how many were.
std::size_t refresh_contacts(const ContactStrands& strands, std::span<const MovingShape> colliders,
                             const DetectionSettings& settings, std::span<Contact> contacts);

// Contacts with spheres and capsules whose edge, anywhere, ends the step nearer than delta and than
// it begins it by more than kOverlaps of the strand's thickness, 2 delta: it may lean on another
// place than its contact's.
// (Flat sides have a contact a vertex; between strands see Detection::overlapping.)
std::size_t overlapping_round_solids(const ContactStrands& strands,
                                     std::span<const MovingShape> colliders,
                                     const DetectionSettings& settings,
                                     std::span<const Contact> contacts);

}  // namespace keratin

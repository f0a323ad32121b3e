#include "bake/read/channels.h"

#include <cassert>

namespace keratin {
namespace {

template <class T, class Out>
void attach(const std::vector<StrandChannels>& strands, std::optional<T> StrandChannels::*member,
            std::vector<Out>& channel) {
    for (const StrandChannels& strand : strands)
        if (!(strand.*member)) return;
    channel.reserve(strands.size());
    for (const StrandChannels& strand : strands)
        channel.push_back(static_cast<Out>(*(strand.*member)));
}

}  // namespace

void attach_channels(RawGroom& groom, const std::vector<StrandChannels>& strands) {
    assert(strands.size() == groom.curves.size());
    attach(strands, &StrandChannels::root_uv, groom.root_uv);
    attach(strands, &StrandChannels::radius, groom.radius);
    attach(strands, &StrandChannels::id, groom.id);
    attach(strands, &StrandChannels::is_guide, groom.is_guide);
    attach(strands, &StrandChannels::closest_guides, groom.closest_guides);
    attach(strands, &StrandChannels::guide_weights, groom.guide_weights);
    for (const StrandChannels& strand : strands)
        if (strand.point_radius.empty()) return;
    groom.point_radius.reserve(strands.size());
    for (const StrandChannels& strand : strands) groom.point_radius.push_back(strand.point_radius);
}

}  // namespace keratin

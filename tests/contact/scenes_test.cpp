#include "tools/scenes/contact_run.h"

#include <catch2/catch.hpp>

#include <utility>

using namespace keratin;
using namespace keratin::scenes;

namespace {

ContactQuality run(ContactScene scene, double duration, Contacts contacts = Contacts::on) {
    scene.duration = duration;
    scene.rod.threads = scene.contact.threads = 1;
    return run_contact_scene(scene, contacts);
}

void check_quality(const ContactScene& scene, double duration) {
    const ContactQuality on = run(scene, duration), off = run(scene, duration, Contacts::off);
    INFO(scene.name << ": overlap " << on.worst_share << " of delta, with solids "
                    << on.worst_solid_share << "; off " << off.worst_share << ", "
                    << off.worst_solid_share << "; f_FB " << on.mean_residual << ", contacts "
                    << on.most_contacts << ", at cap " << on.steps_at_cap);
    CHECK(on.worst_share <= 0.01);
    CHECK(on.worst_solid_share <= 0.01);
    CHECK(on.energy_rise <= 1e-6 * on.energy_scale);
    CHECK(on.mean_residual <= 1e-6);
    CHECK(on.steps_at_cap == 0);
    CHECK(std::max(off.worst_share, off.worst_solid_share) > 0.1);
}

}  // namespace

TEST_CASE("a strand that falls on a strand never overlaps it, and does without contact") {
    check_quality(strand_on_strand(0.3), 0.08);
}

TEST_CASE("a strand that falls on a pipe never overlaps it, and does without contact") {
    check_quality(strand_on_pipe(0.3), 0.05);
}

TEST_CASE("a bundle that falls on a cylinder never overlaps, and does without contact") {
    check_quality(bundle_on_cylinder(7), 0.06);
}

TEST_CASE("a bundle that falls on a bundle never overlaps it, and does without contact") {
    check_quality(bundle_on_bundle(7), 0.06);
}

TEST_CASE("a bundle that falls on the ground never overlaps, and does without contact") {
    check_quality(bundle_on_ground(7), 0.06);
}

TEST_CASE("friction holds a strand on a slanting pipe and its absence does not") {
    const ContactQuality smooth = run(strand_on_pipe(0), 0.15),
                         rough = run(strand_on_pipe(1), 0.15);
    INFO("moved by " << smooth.tip_fall << " m without friction, " << rough.tip_fall << " m with");
    CHECK(smooth.tip_fall > 2 * rough.tip_fall);
}

TEST_CASE("a run saved after a step in halves goes on in the same bits") {
    ContactScene scene = bundle_on_bundle(3);
    scene.rod.threads = scene.contact.threads = 1;
    constexpr double kStep = 1.0 / 60;  // s; so long that strands that land need halves
    struct Run {
        RodSimulation rods;
        StrandContact contact;
        explicit Run(const ContactScene& s)
            : rods(std::move(*RodSimulation::create(s.strands, s.rod))),
              contact(s.contact, s.colliders) {
            rods.attach_contact(&contact);
        }
    };
    Run whole(scene);
    bool halved = false;
    for (int k = 0; k < 40 && !halved; ++k) {
        const auto step = whole.rods.step(kStep);
        REQUIRE(step);
        halved = step->halved > 0 && whole.contact.report().active > 0;
    }
    REQUIRE(halved);
    Run resumed(scene);
    REQUIRE(resumed.rods.restore(whole.rods.save()));
    REQUIRE(resumed.contact.restore(whole.contact.save()));
    for (int k = 0; k < 2; ++k) {
        REQUIRE(whole.rods.step(kStep));
        REQUIRE(resumed.rods.step(kStep));
    }
    CHECK(whole.rods.save() == resumed.rods.save());

    // What is not such a state is refused, and leaves what there was.
    const std::vector<std::byte> good = resumed.contact.save();
    std::vector<std::byte> shorter(good.begin(), good.end() - 1), other = good, endless = good;
    other[0] = std::byte{0};
    for (std::size_t i = good.size() - sizeof(double); i < good.size(); ++i)
        endless[i] = std::byte{0xff};
    for (const std::vector<std::byte>& bad : {std::vector<std::byte>(), shorter, other, endless})
        CHECK(!resumed.contact.restore(bad));
    CHECK(resumed.contact.save() == good);
}

TEST_CASE("the impulse pass ends in the same motion as Gauss-Seidel") {
    ContactScene scene = strand_on_strand(0.3);
    scene.duration = 0.03;
    scene.rod.threads = scene.contact.threads = 1;
    const double by_gauss_seidel = run_contact_scene(scene, Contacts::on).tip_fall;
    scene.contact.method = ContactMethod::impulse;
    scene.rod.iterations = 5000;  // one local answer an iteration
    CHECK(run_contact_scene(scene, Contacts::on).tip_fall == Approx(by_gauss_seidel).epsilon(1e-5));
}

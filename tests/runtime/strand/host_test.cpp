// What a game sees around a simulation: its own memory and messages, buffers of the step before,
// several instances at once, level of detail from frame to frame.
#include "tests/runtime/strand/strand_scene.h"

#include <catch2/catch.hpp>

#include <limits>
#include <new>
#include <string>
#include <thread>

using namespace keratin;
using namespace keratin::test;

namespace {

struct Lender {
    std::size_t now = 0, most = 0, calls = 0;
    bool empty = false, aligned = true;
    std::string messages;
    std::uint32_t warnings = 0;

    Host host() {
        return {this,
                [](void* user, std::size_t bytes, std::size_t alignment) -> void* {
                    Lender& self = *static_cast<Lender*>(user);
                    ++self.calls;
                    if (self.empty && self.calls > 2) return nullptr;
                    self.now += bytes;
                    self.most = std::max(self.most, self.now);
                    void* p = ::operator new(bytes, std::align_val_t{alignment});
                    self.aligned &= reinterpret_cast<std::uintptr_t>(p) % alignment == 0;
                    return p;
                },
                [](void* user, void* p, std::size_t bytes, std::size_t alignment) {
                    static_cast<Lender*>(user)->now -= bytes;
                    ::operator delete(p, std::align_val_t{alignment});
                },
                [](void* user, LogLevel level, const char* message) {
                    Lender& self = *static_cast<Lender*>(user);
                    self.messages += std::string(message) + "\n";
                    self.warnings += level == LogLevel::warning;
                },
                nullptr};
    }
};

scenes::Groom groom_with_strands() {
    scenes::GroomOptions options;
    options.guide_every = 4;
    options.group.strand.friction = {0.1f};
    return head(128, 12, 0.2, options);
}

}  // namespace

TEST_CASE("the host's memory holds the buffers and comes back") {
    const scenes::Groom groom = groom_with_strands();
    Lender lender;
    Settings settings = single_thread();
    settings.host = lender.host();
    {
        Simulation s = made(groom, settings);
        CHECK(lender.aligned);
        CHECK(double(lender.now) > 0.98 * double(s.stats().bytes));
        CHECK(lender.now <= s.stats().bytes);
        const std::size_t calls = lender.calls;
        run(s, 0.2, 1.0 / 60);
        CHECK(lender.calls == calls);
        Simulation plain = made(groom, single_thread());
        run(plain, 0.2, 1.0 / 60);
        CHECK(s.position_hash() == plain.position_hash());
    }
    CHECK(lender.now == 0);
}

TEST_CASE("a host without memory is an error, and what it lent comes back") {
    const scenes::Groom groom = groom_with_strands();
    Lender lender;
    lender.empty = true;
    Settings settings = single_thread();
    settings.host = lender.host();
    auto made = Simulation::create(groom.info, groom.fields, settings);
    REQUIRE_FALSE(made);
    CHECK(made.error().where == "memory");
    CHECK(lender.now == 0);
    settings.host.release = nullptr;
    auto half = Simulation::create(groom.info, groom.fields, settings);
    REQUIRE_FALSE(half);
    CHECK(half.error().where == "host");
}

TEST_CASE("the host hears what was made and what was reset") {
    const scenes::Groom groom = groom_with_strands();
    Lender lender;
    Settings settings = single_thread();
    settings.host = lender.host();
    Simulation s = made(groom, settings);
    CHECK(lender.messages.find("32 guides, 128 render strands") != std::string::npos);
    CHECK(lender.warnings == 0);
    const_cast<float&>(s.guides().position[vector_index(5, 3, 1, 3)]) =
        std::numeric_limits<float>::quiet_NaN();
    must(s.step(1.0 / 60));
    CHECK(lender.warnings == 1);
    CHECK(lender.messages.find("1 strands were not finite") != std::string::npos);
}

TEST_CASE("the strands of the step before are where they were") {
    const scenes::Groom groom = groom_with_strands();
    Settings settings = single_thread();
    settings.previous = true;
    for (OutputPrecision precision : {OutputPrecision::float32, OutputPrecision::float16}) {
        settings.output = precision;
        Simulation s = made(groom, settings);
        const auto present = [&] {
            const StrandView v = s.strands();
            std::vector<float> out(v.position.begin(), v.position.end());
            out.insert(out.end(), v.position_half.begin(), v.position_half.end());
            return out;
        };
        const auto before = [&] {
            const StrandView v = s.strands();
            std::vector<float> out(v.previous.begin(), v.previous.end());
            out.insert(out.end(), v.previous_half.begin(), v.previous_half.end());
            return out;
        };
        CHECK(before() == present());
        for (int i = 1; i <= 5; ++i) {
            const auto was = present();
            must(s.set_motion(shaken(i / 60.0)));
            must(s.step(1.0 / 60));
            REQUIRE(before() == was);
            REQUIRE(present() != was);
        }
        const auto was = present();
        CHECK_FALSE(s.step(-1));
        CHECK(present() == was);
        s.teleport(Velocity::zero);
        CHECK(before() == present());
    }
    CHECK(made(groom, single_thread()).plan().bytes(BufferId::strand_previous) == 0);
}

TEST_CASE("switching the level of detail every frame moves no strand that stays") {
    const scenes::Groom groom = groom_with_strands();
    Settings settings = single_thread();
    settings.previous = true;
    Simulation full = made(groom, settings), less = made(groom, settings);
    const float shares[] = {1, 0.25f, 0.5f, 0.1f, 1, 0, 0.75f, 1};
    for (int i = 1; i <= 40; ++i) {
        must(less.set_lod(shares[i % 8]));
        for (Simulation* s : {&full, &less}) {
            must(s->set_motion(shaken(i / 60.0)));
            must(s->step(1.0 / 60));
        }
        const StrandView a = full.strands(), b = less.strands();
        REQUIRE(b.strand_count == std::uint32_t(128 * double(shares[i % 8])));
        for (std::size_t k = 0; k < std::size_t{b.first_point[b.strand_count]} * 3; ++k) {
            REQUIRE(b.position[k] == a.position[k]);
            // newcomers stand still for a frame, they do not jump from where they last were
            REQUIRE((b.previous[k] == a.previous[k] || b.previous[k] == b.position[k]));
        }
    }
}

TEST_CASE("instances of one asset step on threads of their own as they would alone") {
    const scenes::Groom groom = groom_with_strands();
    const auto shake = [&](int seed) {
        Settings settings = single_thread();
        settings.wind = {{1, 0, 0}, 0.5f, 0.5f};
        settings.seed = std::uint64_t(seed);
        Simulation s = made(groom, settings);
        for (int i = 1; i <= 30; ++i) {
            must(s.set_motion(shaken(i / 60.0)));
            must(s.step(1.0 / 60));
        }
        return s.position_hash();
    };
    std::uint64_t alone[4], together[4];
    for (int k = 0; k < 4; ++k) alone[k] = shake(k);
    std::vector<std::thread> threads;
    for (int k = 0; k < 4; ++k) threads.emplace_back([&, k] { together[k] = shake(k); });
    for (std::thread& t : threads) t.join();
    for (int k = 0; k < 4; ++k) CHECK(together[k] == alone[k]);
    CHECK(alone[0] != alone[1]);
}

TEST_CASE("a host's threads do the work, with the same result") {
    const scenes::Groom groom = groom_with_strands();
    struct Pool {
        std::uint32_t loops = 0, tasks = 0;
        bool in_turn = false;
    } pool;
    Settings settings;
    settings.threads = 3;
    settings.host.user = &pool;
    settings.host.parallel = [](void* user, std::uint32_t count,
                                void (*task)(void* context, std::uint32_t k), void* context) {
        Pool& self = *static_cast<Pool*>(user);
        ++self.loops;
        self.tasks += count;
        if (self.in_turn) {
            for (std::uint32_t k = count; k-- > 0;) task(context, k);
            return;
        }
        std::vector<std::thread> threads;
        for (std::uint32_t k = 0; k < count; ++k) threads.emplace_back(task, context, k);
        for (std::thread& t : threads) t.join();
    };
    const auto shake = [&](const Settings& with) {
        Simulation s = made(groom, with);
        for (int i = 1; i <= 10; ++i) {
            must(s.set_motion(shaken(i / 60.0)));
            must(s.step(1.0 / 60));
        }
        return s.position_hash();
    };
    const auto expected = shake(single_thread());
    CHECK(shake(settings) == expected);
    CHECK(pool.loops > 5);
    CHECK(pool.tasks >= 2 * pool.loops);
    pool.in_turn = true;
    CHECK(shake(settings) == expected);
}

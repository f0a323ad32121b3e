#include "bake/stage/motion_guides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace keratin {
namespace {

// Guides near each strand that are kept track of: those the weights look at, and some that come
// into view when one of them goes.
constexpr std::size_t kNear = kGuideCandidates + 4;
// Followers tried in a guide's place.
constexpr std::size_t kTried = 12;
constexpr int kRounds = 4;
// A round that gains less than this share of the error is the last.
constexpr double kLeastGain = 0.005;

struct Near {
    std::uint32_t slot;    // of the guide
    std::uint32_t strand;  // the guide, as a member
    double squared;        // distance of the features
    bool operator<(const Near& other) const {
        return squared < other.squared || (squared == other.squared && strand < other.strand);
    }
};

// All strands and guides are counted as members of the group here.
class Search {
  public:
    Search(const Groom& groom, std::span<const StrandFeature> features, const GroomMotion& motion,
           const SameSide& same_side, std::span<const std::uint32_t> members)
        : motion_(sampled_motion(groom, motion, members)), same_side_(same_side),
          members_(members) {
        for (std::uint32_t s : members) features_.push_back(features[s]);
    }

    std::vector<std::uint32_t> run(std::vector<std::uint32_t> guides) {
        set(std::move(guides));
        swap();
        set(guides_);
        std::vector<std::uint32_t> best = guides_;
        double least = total();
        for (int round = 0; round < kRounds && guides_.size() > 1; ++round) {
            relocate();
            set(guides_);
            swap();
            set(guides_);
            const double now = total();
            if (now < least) best = guides_;
            if (!(now < (1 - kLeastGain) * least)) break;
            least = now;
        }
        return best;
    }

  private:
    std::span<const Near> near(std::size_t i) const {
        return {near_.data() + i * kNear, near_count_};
    }

    // Takes these guides: who is near whom, and every strand's error, exactly.
    void set(std::vector<std::uint32_t> guides) {
        const std::size_t n = features_.size();
        guides_ = std::move(guides);
        is_guide_.assign(n, 0);
        std::vector<StrandFeature> of_guides;
        for (std::uint32_t g : guides_) {
            is_guide_[g] = 1;
            of_guides.push_back(features_[g]);
        }
        const FeatureTree tree(of_guides);
        near_count_ = std::min(kNear, guides_.size());
        near_.resize(n * kNear);
        error_.resize(n);
#pragma omp parallel for schedule(dynamic, 64)
        for (std::size_t i = 0; i < n; ++i) {
            std::array<std::uint32_t, kNear> slot;
            std::array<double, kNear> squared;
            tree.nearest(features_[i], std::span(slot).first(near_count_),
                         std::span(squared).first(near_count_));
            for (std::size_t k = 0; k < near_count_; ++k) {
                near_[i * kNear + k] = {slot[k], guides_[slot[k]], squared[k]};
            }
            error_[i] = is_guide_[i] ? 0 : error_of(i, near(i));
        }
        users_.assign(guides_.size(), {});
        for (std::size_t i = 0; i < n; ++i) {
            for (const Near& guide : near(i)) {
                users_[guide.slot].push_back(static_cast<std::uint32_t>(i));
            }
        }
    }

    double total() const { return std::accumulate(error_.begin(), error_.end(), 0.0); }

    // Mean squared distance of strand i in motion from where these guides take it.
    double error_of(std::size_t i, std::span<const Near> guides) const {
        std::array<std::uint32_t, kBlendCandidates> guide;
        std::array<double, kBlendCandidates> distance;
        std::size_t kept = 0;
        for (const Near& g : guides.first(std::min(guides.size(), kGuideCandidates))) {
            if (kept == kBlendCandidates) break;
            if (!same_side_(members_[i], members_[g.strand])) continue;
            guide[kept] = g.strand;
            distance[kept++] = std::sqrt(g.squared);
        }
        if (kept == 0) {
            guide[0] = guides.front().strand;
            distance[0] = 0;
            kept = 1;
        }
        const GuideBlend blend =
            blend_nearest(std::span(guide).first(kept), std::span(distance).first(kept));
        const auto m = [&](std::uint32_t s) { return motion_.col(s); };
        return static_cast<double>((m(static_cast<std::uint32_t>(i)) -
                                    static_cast<float>(blend.weight[0]) * m(blend.guide[0]) -
                                    static_cast<float>(blend.weight[1]) * m(blend.guide[1]) -
                                    static_cast<float>(blend.weight[2]) * m(blend.guide[2]))
                                       .squaredNorm());
    }

    // The guides near strand i when the guide of `out` is replaced by strand `in` (or, kNoStrand,
    // taken away; out kNoSlot: nothing is).
    static constexpr std::uint32_t kNoSlot = 0xffffffffu;
    std::size_t changed(std::size_t i, std::uint32_t out, std::uint32_t in,
                        std::array<Near, kNear + 1>& list) const {
        std::size_t count = 0;
        for (const Near& g : near(i)) {
            if (g.slot != out) list[count++] = g;
        }
        if (in == kNoStrand) return count;
        const Near added{out, in, squared_distance(features_[i], features_[in])};
        const auto end = list.begin() + static_cast<std::ptrdiff_t>(count);
        const auto at = std::upper_bound(list.begin(), end, added);
        std::move_backward(at, end, end + 1);
        *at = added;
        return std::min(count + 1, near_count_);
    }

    // How the error of the strands in `of` changes.
    double change(std::span<const std::uint32_t> of, std::uint32_t out, std::uint32_t in) const {
        const std::uint32_t old = out == kNoSlot ? kNoStrand : guides_[out];
        double sum = 0;
        std::array<Near, kNear + 1> list;
        for (std::uint32_t i : of) {
            if (i == in) {
                sum -= error_[i];
                continue;
            }
            if (is_guide_[i] && i != old) continue;
            const std::size_t count = changed(i, out, in, list);
            if (count == 0) continue;
            sum += error_of(i, std::span(list).first(count)) - error_[i];
        }
        return sum;
    }

    void replace(std::uint32_t slot, std::uint32_t in) {
        is_guide_[guides_[slot]] = 0;
        is_guide_[in] = 1;
        std::array<Near, kNear + 1> list;
        for (std::uint32_t i : users_[slot]) {
            const std::size_t count = changed(i, slot, in, list);
            std::copy_n(list.begin(), count, near_.begin() + static_cast<std::ptrdiff_t>(i * kNear));
        }
        guides_[slot] = in;
        for (std::uint32_t i : users_[slot]) error_[i] = is_guide_[i] ? 0 : error_of(i, near(i));
    }

    // Each guide in turn gives its place to the follower with which the error falls most.
    void swap() {
        for (std::uint32_t slot = 0; slot < guides_.size(); ++slot) {
            std::vector<Near> tried;
            for (std::uint32_t i : users_[slot]) {
                if (is_guide_[i]) continue;
                for (std::size_t k = 0; k < std::min<std::size_t>(2, near_count_); ++k) {
                    if (near(i)[k].slot == slot) tried.push_back({slot, i, near(i)[k].squared});
                }
            }
            std::sort(tried.begin(), tried.end());
            if (tried.size() > kTried) tried.resize(kTried);
            std::vector<double> gain(tried.size());
#pragma omp parallel for schedule(dynamic, 1)
            for (std::size_t k = 0; k < tried.size(); ++k) {
                gain[k] = change(users_[slot], slot, tried[k].strand);
            }
            const auto best = std::min_element(gain.begin(), gain.end());
            if (best == gain.end() || !(*best < 0)) continue;
            replace(slot, tried[static_cast<std::size_t>(best - gain.begin())].strand);
        }
    }

    // Guides that are missed least become guides where one is missed most: in each round those
    // whose neighbourhoods do not touch.
    void relocate() {
        const std::size_t slots = guides_.size();
        std::vector<double> loss(slots), gain(slots);
        std::vector<std::uint32_t> added(slots, kNoStrand);
#pragma omp parallel for schedule(dynamic, 1)
        for (std::uint32_t slot = 0; slot < slots; ++slot) {
            loss[slot] = change(users_[slot], slot, kNoStrand);
            // The follower with the largest error.
            double most = 0;
            for (std::uint32_t i : users_[slot]) {
                if (near(i)[0].slot != slot || error_[i] <= most) continue;
                most = error_[i];
                added[slot] = i;
            }
            if (added[slot] != kNoStrand) {
                gain[slot] = -change(users_[slot], kNoSlot, added[slot]);
            }
        }
        std::vector<std::uint32_t> missed(slots), wanted(slots);
        std::iota(missed.begin(), missed.end(), 0u);
        wanted = missed;
        std::sort(missed.begin(), missed.end(), [&](std::uint32_t a, std::uint32_t b) {
            return loss[a] < loss[b] || (loss[a] == loss[b] && a < b);
        });
        std::sort(wanted.begin(), wanted.end(), [&](std::uint32_t a, std::uint32_t b) {
            return gain[a] > gain[b] || (gain[a] == gain[b] && a < b);
        });
        std::vector<std::uint8_t> touched(slots, 0);
        const auto free = [&](std::uint32_t slot) {
            const auto around = near(guides_[slot]).first(std::min(kBlendCandidates, near_count_));
            return std::none_of(around.begin(), around.end(),
                                [&](const Near& g) { return touched[g.slot]; });
        };
        const auto touch = [&](std::uint32_t slot) {
            for (const Near& g : near(guides_[slot]).first(std::min(kBlendCandidates, near_count_)))
                touched[g.slot] = 1;
        };
        std::vector<std::pair<std::uint32_t, std::uint32_t>> moves;
        std::size_t next = 0;
        for (std::uint32_t to : wanted) {
            if (added[to] == kNoStrand || !free(to)) continue;
            while (next < slots && !free(missed[next])) ++next;
            if (next == slots || loss[missed[next]] >= gain[to]) break;
            const std::uint32_t from = missed[next];
            touch(to);
            if (!free(from)) continue;
            touch(from);
            moves.emplace_back(from, added[to]);
        }
        for (const auto& [from, to] : moves) guides_[from] = to;
    }

    Eigen::MatrixXf motion_;  // one column a member
    const SameSide& same_side_;
    std::span<const std::uint32_t> members_;
    std::vector<StrandFeature> features_;
    std::vector<std::uint32_t> guides_;  // by slot
    std::vector<std::uint8_t> is_guide_;
    std::size_t near_count_ = 0;
    std::vector<Near> near_;
    std::vector<double> error_;
    std::vector<std::vector<std::uint32_t>> users_;  // strands that have the slot near
};

}  // namespace

GuideBlend fit_blend(const Eigen::MatrixXf& motion, std::uint32_t strand,
                     std::span<const std::uint32_t> guides) {
    const std::size_t n = std::min(guides.size(), kGuideCandidates);
    // With weights of sum 1 the distance is that of the mean of the guides' distances: w' g w.
    std::array<std::array<double, kGuideCandidates>, kGuideCandidates> g;
    {
        std::array<Eigen::VectorXf, kGuideCandidates> d;
        for (std::size_t i = 0; i < n; ++i) d[i] = motion.col(guides[i]) - motion.col(strand);
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                g[i][j] = g[j][i] = static_cast<double>(d[i].dot(d[j]));
            }
        }
    }
    GuideBlend best;
    double least = std::numeric_limits<double>::infinity();
    const auto offer = [&](double value, std::array<std::size_t, 3> of, std::array<double, 3> w) {
        if (!(value < least)) return;
        least = value;
        for (std::size_t k = 0; k < 3; ++k) best.guide[k] = guides[of[k]];
        best.weight = w;
    };
    for (std::size_t i = 0; i < n; ++i) {
        offer(g[i][i], {i, i, i}, {1, 0, 0});
        for (std::size_t j = 0; j < i; ++j) {
            const double between = g[i][i] + g[j][j] - 2 * g[i][j];
            const double w = (g[j][j] - g[i][j]) / between;
            if (!(w > 0 && w < 1)) continue;
            offer(w * g[i][i] + (1 - w) * g[i][j], {i, j, j}, {w, 1 - w, 0});
            for (std::size_t k = 0; k < j; ++k) {
                // g w = lambda (1, 1, 1), by cofactors; lambda is the value.
                const double a = g[j][j] * g[k][k] - g[j][k] * g[j][k];
                const double b = g[i][k] * g[j][k] - g[i][j] * g[k][k];
                const double c = g[i][j] * g[j][k] - g[i][k] * g[j][j];
                const double e = g[i][i] * g[k][k] - g[i][k] * g[i][k];
                const double f = g[i][j] * g[i][k] - g[i][i] * g[j][k];
                const double h = g[i][i] * g[j][j] - g[i][j] * g[i][j];
                const double u = a + b + c, v = b + e + f, x = c + f + h, sum = u + v + x;
                if (!(u > 0 && v > 0 && x > 0)) continue;
                const double det = g[i][i] * a + g[i][j] * b + g[i][k] * c;
                offer(det / sum, {i, j, k}, {u / sum, v / sum, x / sum});
            }
        }
    }
    // Heaviest first.
    for (std::size_t pass = 0; pass < 2; ++pass) {
        for (std::size_t k = 0; k < 2; ++k) {
            if (best.weight[k] >= best.weight[k + 1]) continue;
            std::swap(best.weight[k], best.weight[k + 1]);
            std::swap(best.guide[k], best.guide[k + 1]);
        }
    }
    return best;
}

std::vector<std::uint32_t> improve_guides(const Groom& groom,
                                          std::span<const StrandFeature> features,
                                          const GroomMotion& motion, const SameSide& same_side,
                                          std::span<const std::uint32_t> members,
                                          std::span<const std::uint32_t> start) {
    std::vector<std::uint32_t> guides;
    for (std::uint32_t s : start) {
        guides.push_back(static_cast<std::uint32_t>(
            std::lower_bound(members.begin(), members.end(), s) - members.begin()));
    }
    guides = Search(groom, features, motion, same_side, members).run(std::move(guides));
    for (std::uint32_t& g : guides) g = members[g];
    return guides;
}

}  // namespace keratin

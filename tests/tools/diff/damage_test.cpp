// A baked file with every field, damaged: opening it in full refuses every flipped bit, cut and
// appended byte; opening its structure alone never reads outside it.
#include "bake/write.h"
#include "tests/tools/diff/full_asset.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

using namespace keratin;

namespace {

// Bytes at a multiple of 32, as the opener wants them, and no more of them than there are: reading
// behind the end is seen by the sanitizers.
class Bytes {
  public:
    explicit Bytes(std::span<const std::byte> bytes)
        : size_(bytes.size()), data_(static_cast<std::byte*>(std::aligned_alloc(32, padded()))) {
        std::copy(bytes.begin(), bytes.end(), data_);
    }
    Bytes(const Bytes&) = delete;
    Bytes& operator=(const Bytes&) = delete;
    ~Bytes() { std::free(data_); }
    std::span<std::byte> bytes() { return {data_, size_}; }

  private:
    std::size_t padded() const { return (size_ + 31) / 32 * 32; }
    std::size_t size_;
    std::byte* data_;
};

// Reads every value that the opener hands out.
double sum_of(const AssetView& view) {
    double sum = 0;
    for_each_field(view.fields(), [&](const FieldDescription&, auto values) {
        for (const auto value : values) sum += static_cast<double>(value);
    });
    return sum;
}

volatile double kept = 0;

}  // namespace

TEST_CASE("any flipped bit, cut or appended byte of an asset with every field is refused") {
    const test::FullAsset asset = test::full_asset();
    const auto written = serialise_asset(asset.info, asset.fields(), "test.kera");
    REQUIRE(written);
    Bytes file(*written);
    REQUIRE(AssetView::from_memory(file.bytes(), "test.kera", Verify::full));
    // The bulk data by sample, everything else bit by bit.
    std::vector<bool> is_bulk(written->size(), false);
    {
        const auto view = AssetView::from_memory(file.bytes(), "test.kera", Verify::structure);
        for_each_field(view->fields(), [&](const FieldDescription&, auto values) {
            const auto bytes = std::as_bytes(values);
            if (bytes.empty() || bytes.data() < file.bytes().data() ||
                bytes.data() >= file.bytes().data() + file.bytes().size())
                return;
            const auto at = static_cast<std::size_t>(bytes.data() - file.bytes().data());
            std::fill_n(is_bulk.begin() + static_cast<std::ptrdiff_t>(at), bytes.size(), true);
        });
    }
    std::mt19937 random(1);
    std::size_t flips = 0, accepted = 0, structural = 0;
    for (std::size_t i = 0; i < written->size(); ++i)
        for (int bit = 0; bit < 8; ++bit) {
            if (is_bulk[i] && random() % 16 != 0) continue;
            ++flips;
            file.bytes()[i] ^= std::byte(1 << bit);
            accepted += bool(AssetView::from_memory(file.bytes(), "test.kera", Verify::full));
            if (const auto view =
                    AssetView::from_memory(file.bytes(), "test.kera", Verify::structure)) {
                ++structural;
                kept = sum_of(*view);
            }
            file.bytes()[i] ^= std::byte(1 << bit);
        }
    CHECK(flips > 10000);
    CHECK(accepted == 0);
    CHECK(structural < flips);
    accepted = 0;
    for (std::size_t size = 0; size < written->size(); ++size) {
        if (size > 4096 && size % 97 != 0) continue;
        Bytes cut(std::span<const std::byte>(*written).first(size));
        accepted += bool(AssetView::from_memory(cut.bytes(), "test.kera", Verify::full));
        if (const auto view = AssetView::from_memory(cut.bytes(), "test.kera", Verify::structure))
            kept = sum_of(*view);
    }
    for (std::size_t more = 1; more <= 64; ++more) {
        std::vector<std::byte> longer = *written;
        longer.resize(written->size() + more);
        Bytes appended(longer);
        accepted += bool(AssetView::from_memory(appended.bytes(), "test.kera", Verify::full));
    }
    CHECK(accepted == 0);
}

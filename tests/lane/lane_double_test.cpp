#include "runtime/lane/lane_double.h"

#include "runtime/lane/instruction_set.h"

#include <catch2/catch.hpp>

using namespace keratin;

TEST_CASE("no instruction set is chosen that the processor lacks") {
    const InstructionSet widest = usable_instruction_set(InstructionSet::automatic);
    CHECK(widest != InstructionSet::automatic);
    CHECK(usable_instruction_set(InstructionSet::avx512) == widest);
    CHECK(usable_instruction_set(InstructionSet::baseline) == InstructionSet::baseline);
}

TEST_CASE("one lane of doubles does the arithmetic of a double") {
    const Double1 a = 3.25, b = -1.5;
    CHECK(mul_add(a, b, Double1(2.0)).v == 3.25 * -1.5 + 2.0);
    CHECK(sub_mul(Double1(2.0), a, b).v == 2.0 - 3.25 * -1.5);
    CHECK(select(b < a, a, b).v == 3.25);
    CHECK(copy_sign(a, b).v == -3.25);
    CHECK(bits(mask_from_bits(a, 2u)) == 0u);
}

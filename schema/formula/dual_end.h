// Takes back what dual.h defined.
#undef KERATIN_FORMULA
#undef Real
#undef Real3
#undef Real4
#undef Bool
#undef KERATIN_OUT
#undef KERATIN_INOUT

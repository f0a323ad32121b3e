// How one text serves C++ and GLSL. A formula is written once as
//
//     KERATIN_FORMULA Real3 reflect_about(Real3 v, Real3 n) { return v - n * (Real(2) * dot(v, n));
//     }
//
// which in C++ is a template on Real (float, double or a lane pack of either) and in GLSL a
// function of float. Formulas are free of branches: `select(condition, a, b)` chooses, `Bool` names
// the type of a condition. Constants are written Real(0.5). Include this header last and dual_end.h
// at the end. (No include guard: it is the counterpart of dual_end.h.)
#ifdef __cplusplus
#define KERATIN_FORMULA   \
    template <class Real> \
    __attribute__((always_inline)) inline
#define Real3 Vec3<Real>
#define Real4 Vec4<Real>
#define Bool auto
#define KERATIN_OUT(type, name) type& name
#define KERATIN_INOUT(type, name) type& name
#else
#define KERATIN_FORMULA
#define Real float
#define Real3 vec3
#define Real4 vec4
#define Bool bool
#define KERATIN_OUT(type, name) out type name
#define KERATIN_INOUT(type, name) inout type name
#endif

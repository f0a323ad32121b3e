#include "bake/read/occt/iges_step.h"

#include "bake/nurbs.h"

#include <BRep_Tool.hxx>
#include <GeomConvert.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_Curve.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <IGESControl_Reader.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <algorithm>

namespace keratin {
namespace {

constexpr double kMetresPerMillimetre = 1e-3;

// The edge's curve as a B-spline and the range of it that the edge covers.
Handle(Geom_BSplineCurve) spline_of(const TopoDS_Edge& edge, double& first, double& last) {
    const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, first, last);  // placed in the world
    if (curve.IsNull()) return {};
    Handle(Geom_BSplineCurve) spline = Handle(Geom_BSplineCurve)::DownCast(curve);
    if (spline.IsNull()) {
        // Lines, arcs and the like: cut to the edge first, for they may be endless.
        spline = GeomConvert::CurveToBSplineCurve(new Geom_TrimmedCurve(curve, first, last));
        if (spline.IsNull()) return {};
        first = spline->FirstParameter();
        last = spline->LastParameter();
    } else {
        spline = Handle(Geom_BSplineCurve)::DownCast(spline->Copy());
    }
    if (spline->IsPeriodic()) spline->SetNotPeriodic();
    return spline;
}

RawCurve to_raw(const Geom_BSplineCurve& spline, double first, double last) {
    RawCurve curve;
    curve.degree = spline.Degree();
    for (int i = 1; i <= spline.NbPoles(); ++i) {
        const gp_Pnt pole = spline.Pole(i);
        curve.points.emplace_back(pole.X(), pole.Y(), pole.Z());
        curve.weights.push_back(spline.Weight(i));
    }
    for (int i = 1; i <= spline.NbKnots(); ++i)
        curve.knots.insert(curve.knots.end(), static_cast<std::size_t>(spline.Multiplicity(i)),
                           spline.Knot(i));
    curve.u_begin = std::max(first, spline.FirstParameter());
    curve.u_end = std::min(last, spline.LastParameter());
    return curve;
}

void add_shape(RawGroom& groom, const TopoDS_Shape& shape, std::size_t& next) {
    for (TopExp_Explorer edges(shape, TopAbs_EDGE, TopAbs_FACE); edges.More(); edges.Next()) {
        const std::size_t index = next++;
        double first = 0, last = 0;
        const Handle(Geom_BSplineCurve) spline =
            spline_of(TopoDS::Edge(edges.Current()), first, last);
        if (spline.IsNull()) {
            groom.problems.push_back({index, 0, "the edge has no curve"});
            continue;
        }
        RawCurve curve = to_raw(*spline, first, last);
        curve.index = index;
        if (auto fault = find_nurbs_fault(curve.points, curve.weights, curve.knots, curve.degree))
            groom.problems.push_back({index, 0, *fault});
        else
            groom.curves.push_back(std::move(curve));
    }
}

Result<RawGroom> read_shapes(XSControl_Reader& reader, const std::string& path) {
    if (reader.ReadFile(path.c_str()) != IFSelect_RetDone)
        return Error{ErrorCode::input, path, "OpenCASCADE cannot read the file"};
    reader.TransferRoots();
    RawGroom groom;
    groom.file = path;
    groom.metres_per_unit = kMetresPerMillimetre;
    std::size_t next = 0;
    for (int i = 1; i <= reader.NbShapes(); ++i) add_shape(groom, reader.Shape(i), next);
    return groom;
}

}  // namespace

Result<RawGroom> read_cad_curves(const std::string& path, CadFormat format) {
    Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));
    try {
        if (format == CadFormat::iges) {
            IGESControl_Reader reader;
            // As the file has them: not cut where they are not smooth.
            Interface_Static::SetIVal("read.iges.bspline.continuity", 0);
            return read_shapes(reader, path);
        }
        STEPControl_Reader reader;
        return read_shapes(reader, path);
    } catch (const Standard_Failure& failure) {
        return Error{
            ErrorCode::input, path,
            std::string("OpenCASCADE cannot read the file: ") + failure.GetMessageString()};
    }
}

}  // namespace keratin

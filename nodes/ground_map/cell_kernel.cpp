// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/cell_kernel.hpp"

#include "nodes/ground_map/floor_projection.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/ground_map/cell_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::ground_map::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// One vector of pixels from x on; D has one lane for the rest of a row.
template <class D>
HWY_INLINE void CellsAt(D d, const CellRow& r, double x, double y, int32_t* out) {
  const auto set = [&](double value) HWY_ATTR { return hn::Set(d, value); };
  const auto& h = r.to_cells;
  const auto across = hn::Iota(d, x), n = set(r.cells), zero = hn::Zero(d);
  const auto w = hn::Add(hn::Mul(set(h[6]), across), set(h[7] * y + h[8]));
  const auto column = hn::Div(hn::Add(hn::Mul(set(h[0]), across), set(h[1] * y + h[2])), w);
  const auto row = hn::Div(hn::Add(hn::Mul(set(h[3]), across), set(h[4] * y + h[5])), w);
  const auto dx = hn::Sub(column, set(r.robot_column)), dy = hn::Sub(row, set(r.robot_row));
  const auto inside =
      hn::And(hn::And(hn::Ge(column, zero), hn::Lt(column, n)), hn::And(hn::Ge(row, zero), hn::Lt(row, n)));
  const auto near = hn::Le(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), set(r.range2));
  const auto seen = hn::And(hn::And(inside, near), hn::Gt(w, set(FloorProjection::kHorizon)));
  // Not a number where w is 0: replaced before the conversion to whole numbers.
  const hn::Rebind<int32_t, D> di;
  const auto c = hn::DemoteTo(di, hn::IfThenElseZero(seen, column));
  const auto l = hn::DemoteTo(di, hn::IfThenElseZero(seen, row));
  const auto none = hn::DemoteTo(di, hn::IfThenElse(seen, zero, set(-1)));
  hn::StoreU(hn::Or(hn::Add(hn::Mul(l, hn::Set(di, r.cells)), c), none), di, out);
}

void CellsOfRow(const CellRow& r, int y, int count, int32_t* out) {
  const hn::ScalableTag<double> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int x = 0;
  for (; x + lanes <= count; x += lanes) CellsAt(d, r, x, y, out + x);
  for (; x < count; ++x) CellsAt(hn::CappedTag<double, 1>(), r, x, y, out + x);
}

}  // namespace takt::ground_map::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::ground_map {

HWY_EXPORT(CellsOfRow);

void cells_of_row(const CellRow& row, int y, int count, int32_t* out) {
  HWY_DYNAMIC_DISPATCH(CellsOfRow)(row, y, count, out);
}

}  // namespace takt::ground_map
#endif

#include "sysid/observe/sheet_shift.h"

namespace flash::sysid {

void add(SheetShifts& a, double share, const SheetShifts& b) {
  if (a.empty()) {
    a = b;
    for (SheetShift& shift : a) {
      shift.positions *= share;
      shift.force *= share;
    }
    return;
  }
  for (std::size_t k = 0; k < a.size(); ++k) {
    a[k].positions += share * b[k].positions;
    a[k].force += share * b[k].force;
  }
}

}  // namespace flash::sysid

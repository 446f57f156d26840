#include "physics/truth.h"

double height(const arex::sim::Truth& truth) { return truth.X_WB.p.z(); }

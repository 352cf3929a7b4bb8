#include "tools/doctor/fix.h"

#include "tools/doctor/host/host_change.h"

namespace axlecast {

std::string Apply(const Fix& fix, const HostFiles& files) {
  switch (fix.kind) {
    case Fix::Kind::kRun:
      return RunProgram(fix.words).problem;
    case Fix::Kind::kWrite:
      return WriteValue(files.Place(fix.path), fix.text);
    case Fix::Kind::kAppend:
      return AppendLine(files.Place(fix.path), fix.text);
    case Fix::Kind::kTell:
      break;
  }
  return "";
}

}  // namespace axlecast

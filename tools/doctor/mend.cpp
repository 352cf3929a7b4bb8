#include "tools/doctor/mend.h"

#include "drivers/io/host_change.h"

namespace axlecast {

std::string Apply(const Remedy& remedy, const HostFiles& files) {
  switch (remedy.kind) {
    case Remedy::Kind::kRun:
      return RunProgram(remedy.words).problem;
    case Remedy::Kind::kWrite:
      return WriteValue(files.Place(remedy.path), remedy.text);
    case Remedy::Kind::kAppend:
      return AppendLine(files.Place(remedy.path), remedy.text);
    case Remedy::Kind::kTell:
      break;
  }
  return "";
}

}  // namespace axlecast

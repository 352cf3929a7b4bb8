#include "core/command/role.h"

namespace axlecast {

std::string_view RoleName(Role role) { return kRoleNames.at(static_cast<std::size_t>(role)); }

bool MayOrder(Role role, const OperationSpec& operation) {
  switch (role) {
    case Role::kObserver:
      return operation.reads_only && !operation.destructive;
    case Role::kOperator:
    case Role::kControl:
      return !operation.destructive;
    case Role::kMaintainer:
      return true;
  }
  return false;
}

std::string_view RolesThatMayOrder(const OperationSpec& operation) {
  if (operation.destructive) return "maintainer";
  return operation.reads_only ? "observer, operator, control or maintainer" : "operator, control or maintainer";
}

}  // namespace axlecast

#pragma once

#include <array>
#include <string_view>

#include "core/command/key_grant.h"
#include "core/device/operation.h"

namespace axlecast {

// The roles' names in the order of Role.
inline constexpr std::array<std::string_view, 4> kRoleNames = {"observer", "operator", "control", "maintainer"};
[[nodiscard]] std::string_view RoleName(Role role);

// Whether a key of this role may order the operation at all.
[[nodiscard]] bool MayOrder(Role role, const OperationSpec& operation);

// The roles that may, for a person: "operator, control or maintainer".
[[nodiscard]] std::string_view RolesThatMayOrder(const OperationSpec& operation);

}  // namespace axlecast

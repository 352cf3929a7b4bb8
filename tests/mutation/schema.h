// Included at the begin of a mutated source. Each mutant has a number; the environment variable AXLECAST_MUTANT chooses the one
// that acts in this process. Each function below takes the numbers of its mutants; 0 is no mutant.
#pragma once

namespace axlecast_mutation {

inline constexpr int kMaxMutants = 8192;
extern int mutant;                          // -1: none, the original program
extern unsigned char reached[kMaxMutants];  // since the last case of the tests began

inline bool Is(int id) {
  reached[id] = 1;
  return id == mutant;
}

inline bool Flip(int id, bool value) { return value != Is(id); }

template <class T>
T Next(int id, T value) {
  return Is(id) ? static_cast<T>(value + 1) : value;
}

// A comparison: with its bound shifted by one, and negated. By value: a constant of an enclosing function needs no capture.
#define AXLECAST_MUTATED_COMPARISON(NAME, OPERATOR, SHIFTED)         \
  template <class A, class B>                                        \
  bool NAME(int shifted, int negated, A a, B b) {                    \
    const bool is_shifted = Is(shifted);                             \
    return Flip(negated, is_shifted ? a SHIFTED b : a OPERATOR b);   \
  }                                                                  \
  template <class A, class B>                                        \
  bool NAME##Ref(int shifted, int negated, const A& a, const B& b) { \
    const bool is_shifted = Is(shifted);                             \
    return Flip(negated, is_shifted ? a SHIFTED b : a OPERATOR b);   \
  }
AXLECAST_MUTATED_COMPARISON(Less, <, <=)
AXLECAST_MUTATED_COMPARISON(LessEqual, <=, <)
AXLECAST_MUTATED_COMPARISON(Greater, >, >=)
AXLECAST_MUTATED_COMPARISON(GreaterEqual, >=, >)

// Arithmetic with another operator.
#define AXLECAST_MUTATED_ARITHMETIC(NAME, OPERATOR, OTHER) \
  template <class A, class B>                              \
  auto NAME(int id, A a, B b)->decltype(a OPERATOR b) {    \
    if (Is(id)) return a OTHER b;                          \
    return a OPERATOR b;                                   \
  }
AXLECAST_MUTATED_ARITHMETIC(Plus, +, -)
AXLECAST_MUTATED_ARITHMETIC(Minus, -, +)
AXLECAST_MUTATED_ARITHMETIC(Times, *, +)
AXLECAST_MUTATED_ARITHMETIC(Over, /, *)
AXLECAST_MUTATED_ARITHMETIC(Modulo, %, /)
AXLECAST_MUTATED_ARITHMETIC(ShiftLeft, <<, >>)
AXLECAST_MUTATED_ARITHMETIC(ShiftRight, >>, <<)
AXLECAST_MUTATED_ARITHMETIC(BitAnd, &, |)
AXLECAST_MUTATED_ARITHMETIC(BitOr, |, &)
AXLECAST_MUTATED_ARITHMETIC(BitXor, ^, |)

#define AXLECAST_MUTATED_ASSIGNMENT(NAME, OPERATOR, OTHER) \
  template <class A, class B>                              \
  A& NAME(int id, A& a, B b) {                             \
    if (Is(id)) return a OTHER b;                          \
    return a OPERATOR b;                                   \
  }
AXLECAST_MUTATED_ASSIGNMENT(AddTo, +=, -=)
AXLECAST_MUTATED_ASSIGNMENT(TakeFrom, -=, +=)
AXLECAST_MUTATED_ASSIGNMENT(OrInto, |=, &=)
AXLECAST_MUTATED_ASSIGNMENT(AndInto, &=, |=)
AXLECAST_MUTATED_ASSIGNMENT(XorInto, ^=, |=)

template <class A>
A& Increment(int id, A& a) {
  return Is(id) ? --a : ++a;
}

template <class A>
A& Decrement(int id, A& a) {
  return Is(id) ? ++a : --a;
}

}  // namespace axlecast_mutation

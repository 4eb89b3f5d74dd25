#include "scene/import/file/step_file.hpp"

#include <gtest/gtest.h>

namespace enfilade::scene {
namespace {

TEST(StepFile, StatementsAreFoundByTheirNumbers) {
  const StepFile file(
      "ISO-10303-21;\nHEADER;\nFILE_SCHEMA (('IFC4'));\nENDSEC;\nDATA;\n"
      "#12 = IFCWALL('a;b',#3, $ );\n#3=IFCDIRECTION((0.,-1.,2.5E-1));\n"
      "ENDSEC;\nEND-ISO-10303-21;\n");
  EXPECT_EQ(file.schema(), "IFC4");
  EXPECT_TRUE(file.hasEnd());
  ASSERT_NE(file.find(12), nullptr);
  EXPECT_EQ(file.find(12)->type, "IFCWALL");
  EXPECT_EQ(file.findOfType(12, "IFCDOOR"), nullptr);
  EXPECT_EQ(file.find(4), nullptr);
  const auto arguments = splitStepArguments(file.find(12)->arguments);
  ASSERT_EQ(arguments.size(), 3u);
  EXPECT_EQ(parseStepString(arguments[0]), "a;b");
  EXPECT_EQ(parseStepReference(arguments[1]), 3u);
  EXPECT_EQ(arguments[2], "$");
  EXPECT_EQ(parseStepNumbers(file.find(3)->arguments), (std::vector<double>{0, -1, 0.25}));
}

TEST(StepFile, CommentsAreNoStatementsButTextsKeepTheirs) {
  const StepFile file("DATA;/* #1=IFCWALL(); */#2=IFCDOOR('/* kept */');");
  EXPECT_EQ(file.find(1), nullptr);
  ASSERT_NE(file.find(2), nullptr);
  EXPECT_EQ(parseStepString(file.find(2)->arguments), "/* kept */");
}

TEST(StepFile, AMissingQuoteCostsOneStatementAndNotTheRest) {
  const StepFile file("#1=IFCWALL('broken,#2);\n#2=IFCDOOR('whole');\n#3=IFCSLAB('whole');\n");
  EXPECT_EQ(file.find(1), nullptr);
  EXPECT_NE(file.find(2), nullptr);
  EXPECT_NE(file.find(3), nullptr);
  EXPECT_EQ(file.damagedCount(), 1u);
}

TEST(StepFile, TextsAreDecodedToUtf8) {
  EXPECT_EQ(parseStepString("'it''s'"), "it's");
  EXPECT_EQ(parseStepString("'T\\X\\FCr'"), "Tür");
  EXPECT_EQ(parseStepString("'\\X2\\00DC\\X0\\ber'"), "Über");
  EXPECT_EQ(parseStepString("'\\X2\\D83DDEAA\\X0\\'"), "\xF0\x9F\x9A\xAA");  // a door emoji as a
                                                                             // surrogate pair
  EXPECT_EQ(parseStepString("'\\X4\\0001F6AA\\X0\\'"), "\xF0\x9F\x9A\xAA");
  EXPECT_EQ(parseStepString("'\\S\\d'"), "ä");
  EXPECT_EQ(parseStepString("'C:\\\\x'"), "C:\\x");
  EXPECT_EQ(parseStepString("'C:\\x'"), "C:\\x") << "text that is no escape stays";
  EXPECT_EQ(parseStepString("12"), std::nullopt);
}

TEST(StepFile, ArgumentsThatAreSomethingElseAreNothing) {
  EXPECT_EQ(parseStepReference("#"), std::nullopt);
  EXPECT_EQ(parseStepReference("#99999999999"), std::nullopt);
  EXPECT_EQ(parseStepNumber("IFCLENGTHMEASURE(0.3048)"), 0.3048);
  EXPECT_EQ(parseStepNumber("'1'"), std::nullopt);
  EXPECT_EQ(parseStepNumber("1e999"), std::nullopt);
  EXPECT_EQ(parseStepEnum(".ELEVATOR."), "ELEVATOR");
  EXPECT_EQ(parseStepEnum("$"), "");
  EXPECT_EQ(parseStepReferences("(#1,#2,$)"), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(parseStepReferences("#7"), std::vector<std::uint32_t>{7});
}

}  // namespace
}  // namespace enfilade::scene

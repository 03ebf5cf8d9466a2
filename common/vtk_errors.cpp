// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/vtk_errors.h"

#include <vtkAlgorithm.h>
#include <vtkExecutive.h>
#include <vtkLogger.h>
#include <vtkOutputWindow.h>
#include <vtkXMLReader.h>

#include <algorithm>

namespace supine {

VtkErrors::VtkErrors(vtkAlgorithm& algorithm)
    : algorithm_(algorithm), verbosity_(vtkLogger::GetCurrentVerbosityCutoff()) {
  command_->SetCallback([](vtkObject*, unsigned long, void* client, void* text) {
    auto& message = *static_cast<std::string*>(client);
    if (message.empty()) message = text != nullptr ? static_cast<const char*>(text) : "no reason given";
  });
  command_->SetClientData(&message_);
  algorithm.AddObserver(vtkCommand::ErrorEvent, command_);
  algorithm.GetExecutive()->AddObserver(vtkCommand::ErrorEvent, command_);
  if (auto* xml = vtkXMLReader::SafeDownCast(&algorithm)) {
    xml->SetReaderErrorObserver(command_);
    xml->SetParserErrorObserver(command_);
  }
  vtkOutputWindow::GetInstance()->AddObserver(vtkCommand::ErrorEvent, command_);  // elements, decompressors
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
}

VtkErrors::~VtkErrors() {
  if (auto* xml = vtkXMLReader::SafeDownCast(&algorithm_)) {
    xml->SetReaderErrorObserver(nullptr);
    xml->SetParserErrorObserver(nullptr);
  }
  vtkLogger::SetStderrVerbosity(static_cast<vtkLogger::Verbosity>(verbosity_));
  vtkOutputWindow::GetInstance()->RemoveObserver(command_);
  algorithm_.RemoveAllObservers();
  algorithm_.GetExecutive()->RemoveAllObservers();
}

bool VtkErrors::any() const { return !message_.empty() || algorithm_.GetErrorCode() != 0; }

std::string VtkErrors::text() const {
  std::string text = message_;
  std::replace(text.begin(), text.end(), '\n', ' ');
  text.erase(text.find_last_not_of(' ') + 1);
  const auto end_of_place = text.find("): ");  // "ERROR: In FILE, line N CLASS (ADDRESS): "
  return text.starts_with("ERROR: In ") && end_of_place != std::string::npos ? text.substr(end_of_place + 3) : text;
}

}  // namespace supine

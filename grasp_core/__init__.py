"""Four-finger force-closure grasps of polyhedra: planning, and proofs either way."""

from grasp_core.closure import ClosureCertificate as ClosureCertificate
from grasp_core.closure import force_closure as force_closure
from grasp_core.critical import critical_friction as critical_friction
from grasp_core.errors import GraspError as GraspError
from grasp_core.errors import InputError as InputError
from grasp_core.errors import MeshError as MeshError
from grasp_core.errors import MeshRefusal as MeshRefusal
from grasp_core.errors import NoForcesError as NoForcesError
from grasp_core.errors import SolverError as SolverError
from grasp_core.errors import UndecidedError as UndecidedError
from grasp_core.forces import contact_forces as contact_forces
from grasp_core.lines import classify_lines as classify_lines
from grasp_core.mesh import load_polyhedron as load_polyhedron
from grasp_core.planner import iter_grasps as iter_grasps
from grasp_core.planner import plan as plan
from grasp_core.plans import Plan as Plan
from grasp_core.quality import max_resisted_wrench as max_resisted_wrench
from grasp_core.spanning import cones_positively_span as cones_positively_span
from grasp_core.spanning import span_angle as span_angle
from grasp_core.values import Contact as Contact
from grasp_core.values import ContactRegion as ContactRegion
from grasp_core.values import Face as Face
from grasp_core.values import ForceCone as ForceCone
from grasp_core.values import Grasp as Grasp
from grasp_core.values import Polyhedron as Polyhedron
from grasp_core.values import Witness as Witness
